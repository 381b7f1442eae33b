//! Executes code.

use std::rc::Rc;

use crate::builtins;
use crate::code::{
    Binary, Clause, ElementKey, Expr, Function, Op, Order, Stmt, StmtKind, Target, Which,
};
use crate::error::{Fault, Outcome};
use crate::meter::{Meter, cost};
use crate::sort_keys::Keys;
use crate::value::Value;
use crate::{Host, Program};

/// Largest nesting depth of calls.
const CALLS: u32 = 16;

/// The state of an execution.
pub(crate) struct Machine<'a> {
    pub(crate) program: &'a Program,
    pub(crate) meter: &'a Rc<Meter>,
    /// Literals.
    pub(crate) texts: &'a [Value],
    /// Constants; `None` before their assignment.
    pub(crate) globals: &'a mut [Option<Value>],
    pub(crate) host: &'a mut dyn Host,
    /// Variables of all open calls; `None` before their assignment.
    pub(crate) stack: &'a mut Vec<Option<Value>>,
    /// Index of the innermost call's first variable.
    pub(crate) base: usize,
    pub(crate) n_calls: u32,
}

/// How a statement ends.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Value),
}

impl Machine<'_> {
    /// Executes the statements outside functions.
    pub(crate) fn start(&mut self) -> Outcome<()> {
        self.ask()?;
        self.stack.clear();
        self.stack.resize_with(self.program.n_start_locals, || None);
        for statement in &self.program.start {
            self.execute(statement)?;
        }
        self.stack.clear();
        Ok(())
    }

    /// Calls a function of the script for the host.
    pub(crate) fn begin_with(
        &mut self,
        function: &Function,
        arguments: &[Value],
    ) -> Outcome<Value> {
        self.ask()?;
        self.call(function, arguments)
    }

    /// Calls a function of the script.
    fn call(&mut self, function: &Function, arguments: &[Value]) -> Outcome<Value> {
        self.enter(function, |stack| {
            stack.extend(arguments.iter().cloned().map(Some));
            Ok(())
        })
    }

    fn enter(
        &mut self,
        function: &Function,
        push_arguments: impl FnOnce(&mut Vec<Option<Value>>) -> Outcome<()>,
    ) -> Outcome<Value> {
        self.begin()?;
        self.meter.spend(function.n_locals)?;
        if self.n_calls == CALLS {
            return Err(format!("more than {CALLS} nested calls").into());
        }
        let base = self.stack.len();
        push_arguments(self.stack)?;
        self.stack.resize_with(base + function.n_locals, || None);
        let outer = std::mem::replace(&mut self.base, base);
        self.n_calls += 1;
        let flow = self.block(&function.body);
        self.n_calls -= 1;
        self.base = outer;
        self.stack.truncate(base);
        match flow? {
            Flow::Return(value) => Ok(value),
            _ => Ok(Value::Nothing),
        }
    }

    /// Begins a statement, iteration or call: counts its work, and regularly asks the host
    /// whether to continue.
    #[inline]
    fn begin(&mut self) -> Result<(), String> {
        self.meter.work(1)?;
        if self.meter.is_question_due() { self.ask() } else { Ok(()) }
    }

    /// Asks the host whether to continue.
    fn ask(&mut self) -> Result<(), String> {
        self.meter.ask_later();
        if self.host.goes_on() { Ok(()) } else { Err("the script was stopped".into()) }
    }

    fn block(&mut self, block: &[Stmt]) -> Outcome<Flow> {
        for statement in block {
            match self.execute(statement)? {
                Flow::Next => {}
                flow => return Ok(flow),
            }
        }
        Ok(Flow::Next)
    }

    fn execute(&mut self, statement: &Stmt) -> Outcome<Flow> {
        let line = statement.line;
        self.begin().map_err(|message| Fault::new(line, message))?;
        match &statement.kind {
            StmtKind::Expr(expr) => {
                self.eval(expr)?;
            }
            StmtKind::Assign(target, expr) => {
                let value = self.eval(expr)?;
                self.assign(target, value).map_err(|fault| fault.at(line))?;
            }
            StmtKind::Modify(target, operator, expr) => {
                self.modify(target, *operator, expr).map_err(|fault| fault.at(line))?;
            }
            StmtKind::If(conditions, otherwise) => {
                for (condition, block) in conditions {
                    if self.eval(condition)?.is_true() {
                        return self.block(block);
                    }
                }
                return self.block(otherwise);
            }
            StmtKind::For(target, list, body) => {
                let list = self.eval(list)?;
                let elements = builtins::elements(&list, self.meter);
                for value in elements.map_err(|fault| fault.at(line))? {
                    self.begin().map_err(|message| Fault::new(line, message))?;
                    self.assign(target, value).map_err(|fault| fault.at(line))?;
                    match self.block(body)? {
                        Flow::Next | Flow::Continue => {}
                        Flow::Break => break,
                        Flow::Return(value) => return Ok(Flow::Return(value)),
                    }
                }
            }
            StmtKind::Return(expr) => {
                let value = expr.as_ref().map_or(Ok(Value::Nothing), |expr| self.eval(expr))?;
                return Ok(Flow::Return(value));
            }
            StmtKind::Break => return Ok(Flow::Break),
            StmtKind::Continue => return Ok(Flow::Continue),
            StmtKind::Pass => {}
        }
        Ok(Flow::Next)
    }

    fn assign(&mut self, target: &Target, value: Value) -> Outcome<()> {
        match target {
            Target::Local(slot) => self.stack[self.base + slot] = Some(value),
            Target::Global(slot) => {
                value.freeze();
                self.globals[*slot] = Some(value);
            }
            Target::Unpack(targets) => {
                let values = builtins::elements(&value, self.meter)?;
                let (expected, found) = (targets.len(), values.len());
                if expected != found {
                    return Err(format!("{found} values for {expected} names").into());
                }
                for (target, value) in targets.iter().zip(values) {
                    self.assign(target, value)?;
                }
            }
            Target::Index(place) => {
                let container = self.eval(&place.0)?;
                let index = self.eval(&place.1)?;
                store(&container, &index, value)?;
            }
            Target::Attribute(thing, name) => {
                let thing = self.eval(thing)?;
                self.set_attribute(&thing, *name, value)?;
            }
        }
        Ok(())
    }

    fn set_attribute(&mut self, thing: &Value, name: u16, value: Value) -> Outcome<()> {
        let Value::Object(object) = thing else {
            let message = format!("{} has no attributes", thing.kind_with_article());
            return Err(message.into());
        };
        Ok(self.host.set(*object, name, value)?)
    }

    /// `target operator= expr`; the target's parts are evaluated once.
    fn modify(&mut self, target: &Target, operator: Binary, expr: &Expr) -> Outcome<()> {
        let meter = self.meter;
        match target {
            Target::Local(_) | Target::Global(_) => {
                let old = match target {
                    Target::Local(slot) => self.stack[self.base + slot].clone(),
                    _ => None,
                };
                let old = old.ok_or("this variable has no value yet")?;
                let new = builtins::binary(operator, &old, &self.eval(expr)?, meter)?;
                self.assign(target, new)
            }
            Target::Index(place) => {
                let container = self.eval(&place.0)?;
                let index = self.eval(&place.1)?;
                let old = builtins::element(&container, &index)?;
                let new = builtins::binary(operator, &old, &self.eval(expr)?, meter)?;
                store(&container, &index, new)
            }
            Target::Attribute(thing, name) => {
                let thing = self.eval(thing)?;
                let old = self.attribute(&thing, *name)?;
                let new = builtins::binary(operator, &old, &self.eval(expr)?, meter)?;
                self.set_attribute(&thing, *name, new)
            }
            Target::Unpack(_) => Err("several names cannot be changed at once".into()),
        }
    }

    fn attribute(&mut self, thing: &Value, name: u16) -> Outcome<Value> {
        let Value::Object(object) = thing else {
            let message = format!("{} has no attributes", thing.kind_with_article());
            return Err(message.into());
        };
        Ok(self.host.get(*object, name, self.meter)?)
    }

    fn all(&mut self, exprs: &[Expr]) -> Outcome<Vec<Value>> {
        exprs.iter().map(|expr| self.eval(expr)).collect()
    }

    /// Hands the values of expressions to a function. Up to two of them need no allocation.
    fn with_all<T>(
        &mut self,
        exprs: &[Expr],
        take: impl FnOnce(&mut Self, &[Value]) -> Outcome<T>,
    ) -> Outcome<T> {
        match exprs {
            [a] => {
                let values = [self.eval(a)?];
                take(self, &values)
            }
            [a, b] => {
                let values = [self.eval(a)?, self.eval(b)?];
                take(self, &values)
            }
            _ => self.all(exprs).and_then(|values| take(self, &values)),
        }
    }

    fn eval(&mut self, expr: &Expr) -> Outcome<Value> {
        self.operation(&expr.op).map_err(|fault| fault.at(expr.line))
    }

    fn operation(&mut self, op: &Op) -> Outcome<Value> {
        let meter = self.meter;
        meter.spend(cost::OPERATION)?;
        Ok(match op {
            Op::Local(slot) => {
                let value = self.stack[self.base + slot].clone();
                value.ok_or("this variable has no value yet")?
            }
            Op::Float(value) => Value::Float(*value),
            Op::Int(value) => Value::Int(*value),
            Op::Binary(operator, operands) => {
                let a = self.eval(&operands.0)?;
                let b = self.eval(&operands.1)?;
                return builtins::binary(*operator, &a, &b, meter);
            }
            Op::Attribute(thing, name) => {
                let thing = self.eval(thing)?;
                return self.attribute(&thing, *name);
            }
            Op::And(operands) => {
                let a = self.eval(&operands.0)?;
                if a.is_true() { self.eval(&operands.1)? } else { a }
            }
            Op::Or(operands) => {
                let a = self.eval(&operands.0)?;
                if a.is_true() { a } else { self.eval(&operands.1)? }
            }
            Op::Not(operand) => Value::Bool(!self.eval(operand)?.is_true()),
            Op::If(parts) => {
                let holds = self.eval(&parts.0)?.is_true();
                self.eval(if holds { &parts.1 } else { &parts.2 })?
            }
            Op::Negative(operand) => match self.eval(operand)? {
                Value::Float(value) => Value::Float(-value),
                Value::Int(value) => match value.checked_neg() {
                    Some(value) => Value::Int(value),
                    None => Value::Float(-(value as f64)),
                },
                other => {
                    return Err(
                        format!("`-` takes a number, not {}", other.kind_with_article()).into()
                    );
                }
            },
            Op::Positive(operand) => match self.eval(operand)? {
                value @ (Value::Float(_) | Value::Int(_)) => value,
                other => {
                    return Err(
                        format!("`+` takes a number, not {}", other.kind_with_article()).into()
                    );
                }
            },
            Op::Index(parts) => {
                let container = self.eval(&parts.0)?;
                let index = self.eval(&parts.1)?;
                builtins::element(&container, &index)?
            }
            Op::Slice(parts) => {
                let value = self.eval(&parts.0)?;
                let mut bound = |bound: &Option<Expr>| match bound {
                    Some(expr) => self.eval(expr),
                    None => Ok(Value::Nothing),
                };
                let (from, to) = (bound(&parts.1)?, bound(&parts.2)?);
                builtins::slice(&value, &from, &to, meter)?
            }
            Op::Call(function, arguments) => {
                let program = self.program;
                return self.with_all(arguments, |machine, values| {
                    machine.call(&program.functions[*function], values)
                });
            }
            Op::Builtin(function, arguments) => {
                return self
                    .with_all(arguments, |_, values| builtins::builtin(*function, values, meter));
            }
            Op::Order(order) => self.order(order)?,
            Op::Method(thing, called, arguments) => {
                let thing = self.eval(thing)?;
                return self.with_all(arguments, |machine, values| {
                    match (&thing, called.host, called.container) {
                        (Value::Object(object), Some(name), _) => {
                            machine.begin()?;
                            Ok(machine.host.call(*object, name, values, meter)?)
                        }
                        (_, _, Some(method)) => builtins::method(&thing, method, values, meter),
                        _ => {
                            Err(format!("{} has no such method", thing.kind_with_article()).into())
                        }
                    }
                });
            }
            Op::Nothing => Value::Nothing,
            Op::Bool(value) => Value::Bool(*value),
            Op::Text(text) => self.texts[*text].clone(),
            Op::Global(slot) => {
                self.globals[*slot].clone().ok_or("this constant has no value yet")?
            }
            Op::List(items) => Value::list(self.all(items)?, meter)?,
            Op::Tuple(items) => Value::tuple(self.all(items)?, meter)?,
            Op::Dict(entries) => {
                let dict = Value::dict(meter)?;
                for (key, value) in entries {
                    let key = self.eval(key)?;
                    let value = self.eval(value)?;
                    store(&dict, &key, value)?;
                }
                dict
            }
            Op::ListOf(value, clauses) => {
                let list = Value::list(Vec::new(), meter)?;
                self.comprehend(clauses, &mut |machine| {
                    let value = machine.eval(value)?;
                    append(&list, value)
                })?;
                list
            }
            Op::DictOf(entry, clauses) => {
                let dict = Value::dict(meter)?;
                self.comprehend(clauses, &mut |machine| {
                    let key = machine.eval(&entry.0)?;
                    let value = machine.eval(&entry.1)?;
                    store(&dict, &key, value)
                })?;
                dict
            }
        })
    }

    fn comprehend(
        &mut self,
        clauses: &[Clause],
        each: &mut dyn FnMut(&mut Self) -> Outcome<()>,
    ) -> Outcome<()> {
        match clauses {
            [] => each(self),
            [Clause::If(condition), rest @ ..] => {
                if self.eval(condition)?.is_true() {
                    self.comprehend(rest, each)
                } else {
                    Ok(())
                }
            }
            [Clause::For(target, list), rest @ ..] => {
                let list = self.eval(list)?;
                for value in builtins::elements(&list, self.meter)? {
                    self.begin()?;
                    self.assign(target, value)?;
                    self.comprehend(rest, each)?;
                }
                Ok(())
            }
        }
    }

    fn order(&mut self, Order { which, list, key, reverse }: &Order) -> Outcome<Value> {
        let list = self.eval(list)?;
        let mut keyed = Vec::new();
        for value in builtins::elements(&list, self.meter)? {
            let program = self.program;
            let key = match key {
                None => value.clone(),
                Some(ElementKey::Function(function)) => {
                    self.call(&program.functions[*function], std::slice::from_ref(&value))?
                }
                Some(ElementKey::Lambda(slot, key)) => {
                    self.stack[self.base + slot] = Some(value.clone());
                    self.eval(key)?
                }
            };
            keyed.push((key, value));
        }
        if *which == Which::All {
            let is_reverse = match reverse {
                Some(reverse) => self.eval(reverse)?.is_true(),
                None => false,
            };
            return self.sorted(keyed, is_reverse);
        }
        let mut best: Option<(Value, Value)> = None;
        for (key, value) in keyed {
            let is_better = match &best {
                None => true,
                Some((best, _)) => {
                    let order = builtins::order(&key, best, self.meter)?;
                    if *which == Which::First { order.is_lt() } else { order.is_gt() }
                }
            };
            if is_better {
                best = Some((key, value));
            }
        }
        best.map(|(_, value)| value)
            .ok_or_else(|| "an empty list has no smallest or largest element".into())
    }

    /// Values in the order of their keys; the sort is stable.
    fn sorted(&mut self, mut keyed: Vec<(Value, Value)>, is_reverse: bool) -> Outcome<Value> {
        let n_rounds = keyed.len().max(1).ilog2() as usize;
        self.meter.work(keyed.len() * n_rounds)?;
        let keys = Keys::from_keyed(&keyed)?;
        self.meter.read(2 * n_rounds * keys.n_bytes)?;
        keyed.sort_by(|(a, _), (b, _)| {
            let order = keys.order(a, b);
            if is_reverse { order.reverse() } else { order }
        });
        let values = keyed.into_iter().map(|(_, value)| value).collect();
        Ok(Value::list(values, self.meter)?)
    }
}

/// `container[index] = value`.
fn store(container: &Value, index: &Value, value: Value) -> Outcome<()> {
    match container {
        Value::List(list) => list.set(builtins::place(index, list.len())?, value),
        Value::Dict(dict) => dict.set(dict.key(index)?, value),
        _ => Err(format!("{} has no elements", container.kind_with_article()).into()),
    }
}

fn append(list: &Value, value: Value) -> Outcome<()> {
    match list {
        Value::List(list) => list.insert(list.len(), value),
        _ => Ok(()),
    }
}

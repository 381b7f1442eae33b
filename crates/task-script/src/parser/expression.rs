//! Expressions.

use experiment_file::suggestion;

use super::{Parser, REFUSED};
use crate::code::{
    Binary, Builtin, Called, DEPTH, ElementKey, Expr, Method, Name, Op, Order, Which,
};
use crate::error::{Outcome, shortened};
use crate::lexer::Kind;

/// The arguments of a call.
struct Arguments {
    values: Vec<Expr>,
    key: Option<ElementKey>,
    reverse: Option<Expr>,
}

impl<'a> Parser<'a> {
    /// An expression, or several, which make a tuple.
    pub(super) fn expression_list(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let first = self.expression()?;
        if *self.kind() != Kind::Operator(",") {
            return Ok(first);
        }
        let mut values = vec![first];
        while self.accept(",") {
            if matches!(self.kind(), Kind::Newline | Kind::Operator(")" | "=" | ":")) {
                break;
            }
            values.push(self.expression()?);
        }
        self.expr(line, Op::Tuple(values))
    }

    pub(super) fn expression(&mut self) -> Outcome<Expr> {
        self.deeper()?;
        let line = self.line();
        let value = self.any_of()?;
        let value = if self.accept_word("if") {
            let condition = self.any_of()?;
            if !self.accept_word("else") {
                return Err(self.fault(format!("expected `else`, found {}", self.found())));
            }
            let otherwise = self.expression()?;
            self.expr(line, Op::If(Box::new((condition, value, otherwise))))?
        } else {
            value
        };
        self.depth -= 1;
        Ok(value)
    }

    pub(super) fn any_of(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let mut value = self.all_of()?;
        while self.accept_word("or") {
            let other = self.all_of()?;
            value = self.expr(line, Op::Or(Box::new((value, other))))?;
        }
        Ok(value)
    }

    fn all_of(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let mut value = self.negation()?;
        while self.accept_word("and") {
            let other = self.negation()?;
            value = self.expr(line, Op::And(Box::new((value, other))))?;
        }
        Ok(value)
    }

    fn negation(&mut self) -> Outcome<Expr> {
        let line = self.line();
        if !self.accept_word("not") {
            return self.comparison();
        }
        self.deeper()?;
        let value = self.negation()?;
        self.depth -= 1;
        self.expr(line, Op::Not(Box::new(value)))
    }

    fn comparison(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let value = self.sum()?;
        let Some(comparison) = self.accept_comparison() else { return Ok(value) };
        let other = self.sum()?;
        if self.accept_comparison().is_some() {
            return Err(self.fault("comparisons are not chained; write `a < b and b < c`"));
        }
        self.expr(line, Op::Binary(comparison, Box::new((value, other))))
    }

    fn accept_comparison(&mut self) -> Option<Binary> {
        let comparison = match self.kind() {
            Kind::Operator("==") => Binary::Equal,
            Kind::Operator("!=") => Binary::NotEqual,
            Kind::Operator("<") => Binary::Less,
            Kind::Operator("<=") => Binary::LessOrEqual,
            Kind::Operator(">") => Binary::Greater,
            Kind::Operator(">=") => Binary::GreaterOrEqual,
            Kind::Name("in") => Binary::In,
            Kind::Name("not") if self.tokens[self.at + 1].kind == Kind::Name("in") => {
                self.at += 1;
                Binary::NotIn
            }
            _ => return None,
        };
        self.at += 1;
        Some(comparison)
    }

    fn sum(&mut self) -> Outcome<Expr> {
        let mut value = self.product()?;
        loop {
            let operator = match self.kind() {
                Kind::Operator("+") => Binary::Add,
                Kind::Operator("-") => Binary::Subtract,
                _ => return Ok(value),
            };
            let line = self.line();
            self.at += 1;
            let other = self.product()?;
            value = self.expr(line, Op::Binary(operator, Box::new((value, other))))?;
        }
    }

    fn product(&mut self) -> Outcome<Expr> {
        let mut value = self.signed()?;
        loop {
            let operator = match self.kind() {
                Kind::Operator("*") => Binary::Multiply,
                Kind::Operator("/") => Binary::Divide,
                Kind::Operator("//") => Binary::FloorDivide,
                Kind::Operator("%") => Binary::Remainder,
                Kind::Operator("**") => {
                    return Err(self.fault("there is no `**`; use `math.pow(a, b)`"));
                }
                _ => return Ok(value),
            };
            let line = self.line();
            self.at += 1;
            let other = self.signed()?;
            value = self.expr(line, Op::Binary(operator, Box::new((value, other))))?;
        }
    }

    fn signed(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let is_negative = self.accept("-");
        if !is_negative && !self.accept("+") {
            return self.operand();
        }
        self.deeper()?;
        let value = Box::new(self.signed()?);
        self.depth -= 1;
        self.expr(line, if is_negative { Op::Negative(value) } else { Op::Positive(value) })
    }

    /// A value with its calls, attributes and indices.
    pub(super) fn operand(&mut self) -> Outcome<Expr> {
        let mut value = self.atom()?;
        loop {
            let line = self.line();
            if self.accept(".") {
                value = self.attribute(value, line)?;
            } else if self.accept("[") {
                value = self.index(value, line)?;
            } else if *self.kind() == Kind::Operator("(") {
                return Err(self.fault("only functions and methods can be called"));
            } else {
                return Ok(value);
            }
        }
    }

    fn attribute(&mut self, value: Expr, line: u32) -> Outcome<Expr> {
        let Kind::Name(name) = *self.kind() else {
            return Err(self.fault(format!("expected a name after `.`, found {}", self.found())));
        };
        self.at += 1;
        let is_call = self.accept("(");
        let host = self.vocabulary.names.iter().position(|known| *known == name);
        let host = host.map(|index| index as Name);
        let container = if is_call { Method::named(name) } else { None };
        if host.is_none() && container.is_none() {
            let methods: &[&str] = if is_call { Method::NAMES } else { &[] };
            self.unknown(line, "no object has a", name, |parser| {
                parser.vocabulary.names.iter().chain(methods).copied().collect()
            });
        }
        if !is_call {
            return self.expr(line, Op::Attribute(Box::new(value), host.unwrap_or_default()));
        }
        let Arguments { values, key, reverse } = self.arguments()?;
        if key.is_some() || reverse.is_some() {
            self.problem(line, format!("`{name}` takes no arguments by name"));
        }
        self.expr(line, Op::Method(Box::new(value), Called { container, host }, values))
    }

    fn index(&mut self, value: Expr, line: u32) -> Outcome<Expr> {
        let from =
            if *self.kind() == Kind::Operator(":") { None } else { Some(self.expression_list()?) };
        if !self.accept(":") {
            self.expect("]")?;
            let Some(index) = from else { return Err(self.fault("expected an index")) };
            return self.expr(line, Op::Index(Box::new((value, index))));
        }
        let to = if *self.kind() == Kind::Operator("]") { None } else { Some(self.expression()?) };
        self.expect("]")?;
        self.expr(line, Op::Slice(Box::new((value, from, to))))
    }

    fn atom(&mut self) -> Outcome<Expr> {
        let line = self.line();
        let kind = self.kind();
        self.at += 1;
        let op = match kind {
            Kind::Int(value) => Op::Int(*value),
            Kind::Float(value) => Op::Float(*value),
            Kind::Text(text) => {
                let mut text = text.clone();
                while let Kind::Text(more) = self.kind() {
                    text.push_str(more);
                    self.at += 1;
                }
                self.text(text)
            }
            Kind::Name("None") => Op::Nothing,
            Kind::Name("True") => Op::Bool(true),
            Kind::Name("False") => Op::Bool(false),
            Kind::Name("math") => return self.math(line),
            Kind::Name("lambda") => {
                let message = "a lambda can only be the `key` of `sorted`, `min` or `max`";
                return Err(crate::error::Fault::new(line, message));
            }
            Kind::Name(name) if *self.kind() == Kind::Operator("(") => {
                self.at += 1;
                return self.call(name, line);
            }
            Kind::Name(name) => {
                if super::KEYWORDS.contains(name) {
                    self.at -= 1;
                    return Err(self.fault(format!("expected a value, found {}", self.found())));
                }
                self.variable(name, line)
            }
            Kind::Operator("(") => return self.parenthesised(line),
            Kind::Operator("[") => return self.list(line),
            Kind::Operator("{") => return self.dict(line),
            _ => {
                self.at -= 1;
                return Err(self.fault(format!("expected a value, found {}", self.found())));
            }
        };
        self.expr(line, op)
    }

    fn text(&mut self, text: String) -> Op {
        let known = self.texts.iter().position(|known| *known == text);
        Op::Text(known.unwrap_or_else(|| {
            self.texts.push(text);
            self.texts.len() - 1
        }))
    }

    fn math(&mut self, line: u32) -> Outcome<Expr> {
        self.expect(".")?;
        let Kind::Name(name) = *self.kind() else {
            return Err(self.fault("expected a name after `math.`"));
        };
        self.at += 1;
        match name {
            "pi" => return self.expr(line, Op::Float(std::f64::consts::PI)),
            "tau" => return self.expr(line, Op::Float(std::f64::consts::TAU)),
            "inf" => return self.expr(line, Op::Float(f64::INFINITY)),
            _ => {}
        }
        let Some(builtin) = Builtin::named(&format!("math.{name}")) else {
            let functions = Builtin::NAMES.iter().filter_map(|name| name.strip_prefix("math."));
            let known: Vec<&str> = functions.chain(["pi", "tau", "inf"]).collect();
            let message =
                format!("`math` has no `{}`; {}", shortened(name), suggestion(name, &known));
            return Err(crate::error::Fault::new(line, message));
        };
        self.expect("(")?;
        let Arguments { values, .. } = self.arguments()?;
        self.expr(line, Op::Builtin(builtin, values))
    }

    /// A call of a function by its name.
    fn call(&mut self, name: &'a str, line: u32) -> Outcome<Expr> {
        let Arguments { mut values, key, reverse } = self.arguments()?;
        let function = self.signatures.iter().position(|(function, _)| *function == name);
        if let Some(function) = function {
            let (expected, found) = (self.signatures[function].1, values.len());
            if expected != found {
                let message = format!("`{name}` takes {expected} arguments, found {found}");
                self.problem(line, message);
            }
            if key.is_some() || reverse.is_some() {
                self.problem(line, format!("`{name}` takes no arguments by name"));
            }
            return self.expr(line, Op::Call(function, values));
        }
        let which = match name {
            "sorted" => Some(Which::All),
            "min" => Some(Which::First),
            "max" => Some(Which::Last),
            _ => None,
        };
        match which {
            Some(which) if values.len() == 1 => {
                let list = values.remove(0);
                return self.expr(line, Op::Order(Box::new(Order { which, list, key, reverse })));
            }
            _ if key.is_some() || reverse.is_some() => {
                self.problem(line, format!("`{name}` takes no `key` or `reverse` here"));
            }
            _ => {}
        }
        if let Some(builtin) = Builtin::named(name) {
            return self.expr(line, Op::Builtin(builtin, values));
        }
        match REFUSED.iter().find(|(word, _)| *word == name) {
            Some((_, advice)) => self.problem(line, *advice),
            None => self.unknown(line, "no function is named", name, |parser| {
                let functions = parser.signatures.iter().map(|(name, _)| *name);
                functions.chain(Builtin::NAMES.iter().copied()).collect()
            }),
        }
        self.expr(line, Op::Nothing)
    }

    fn arguments(&mut self) -> Outcome<Arguments> {
        let mut arguments = Arguments { values: Vec::new(), key: None, reverse: None };
        while !self.accept(")") {
            let is_named = self.tokens[self.at + 1].kind == Kind::Operator("=");
            match *self.kind() {
                Kind::Name("key") if is_named => {
                    self.at += 2;
                    arguments.key = Some(self.element_key()?);
                }
                Kind::Name("reverse") if is_named => {
                    self.at += 2;
                    arguments.reverse = Some(self.expression()?);
                }
                Kind::Name(_) if is_named => {
                    return Err(self.fault("arguments are given by position, not by name"));
                }
                _ => arguments.values.push(self.expression()?),
            }
            if !self.accept(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(arguments)
    }

    /// The value of `key=`: a lambda of one argument, or a function of the script.
    fn element_key(&mut self) -> Outcome<ElementKey> {
        if !self.accept_word("lambda") {
            let Kind::Name(name) = *self.kind() else {
                return Err(self.fault("expected a function or `lambda x: ...`"));
            };
            let function = self.signatures.iter().position(|(function, _)| *function == name);
            let Some(function) = function.filter(|&function| self.signatures[function].1 == 1)
            else {
                return Err(self.fault("expected a function of one argument or `lambda x: ...`"));
            };
            self.at += 1;
            return Ok(ElementKey::Function(function));
        }
        let name = self.own_name()?;
        self.expect(":")?;
        let mark = self.scope.open();
        let slot = self.scope.assign(name);
        let value = self.expression()?;
        self.scope.close(mark);
        Ok(ElementKey::Lambda(slot, value))
    }

    fn parenthesised(&mut self, line: u32) -> Outcome<Expr> {
        if self.accept(")") {
            return self.expr(line, Op::Tuple(Vec::new()));
        }
        let value = self.expression_list()?;
        if *self.kind() == Kind::Name("for") {
            return Err(self.fault("there are no generators; use a list, `[...]`"));
        }
        self.expect(")")?;
        Ok(value)
    }

    /// An expression, unless it is too deep.
    pub(super) fn expr(&self, line: u32, op: Op) -> Outcome<Expr> {
        let depth = super::depth::within(&op).saturating_add(1);
        if depth > DEPTH {
            let message = "too many operations in one expression; use variables";
            return Err(crate::error::Fault::new(line, message));
        }
        Ok(Expr { line, depth, op })
    }
}

//! The functions, methods and operators of the language itself.

use std::cmp::Ordering;
use std::rc::Rc;

use crate::code::{Binary, Builtin, Method};
use crate::error::{Fault, MESSAGE_CHARS, Outcome, shortened};
use crate::meter::{Meter, cost};
use crate::value::{Dict, ELEMENT, List, Value};

/// The result of a binary operator.
pub(crate) fn binary(operator: Binary, a: &Value, b: &Value, meter: &Rc<Meter>) -> Outcome<Value> {
    if let (Value::Int(a), Value::Int(b)) = (a, b) {
        return integers(operator, *a, *b, meter);
    }
    if let (Some(a), Some(b)) = (a.number(), b.number()) {
        return floats(operator, a, b, meter);
    }
    Ok(match operator {
        Binary::Equal => Value::Bool(a.equals(b, meter)?),
        Binary::NotEqual => Value::Bool(!a.equals(b, meter)?),
        Binary::In => Value::Bool(contains(b, a, meter)?),
        Binary::NotIn => Value::Bool(!contains(b, a, meter)?),
        Binary::Less => Value::Bool(order(a, b, meter)?.is_lt()),
        Binary::LessOrEqual => Value::Bool(order(a, b, meter)?.is_le()),
        Binary::Greater => Value::Bool(order(a, b, meter)?.is_gt()),
        Binary::GreaterOrEqual => Value::Bool(order(a, b, meter)?.is_ge()),
        Binary::Add => return add(a, b, meter),
        _ => return Err(not_for(operator, a, b)),
    })
}

fn not_for(operator: Binary, a: &Value, b: &Value) -> Fault {
    let symbol = operator.symbol();
    format!("`{symbol}` does not take {} and {}", a.kind(), b.kind()).into()
}

fn integers(operator: Binary, a: i64, b: i64, meter: &Meter) -> Outcome<Value> {
    let value = match operator {
        Binary::Add => a.checked_add(b),
        Binary::Subtract => a.checked_sub(b),
        Binary::Multiply => a.checked_mul(b),
        Binary::FloorDivide if b != 0 => a.checked_div_euclid(b).map(|quotient| {
            // Rounds down for all signs.
            if b < 0 && a.rem_euclid(b) != 0 { quotient - 1 } else { quotient }
        }),
        Binary::Remainder if b != 0 => a
            .checked_rem(b)
            .map(|rest| if rest != 0 && (rest < 0) != (b < 0) { rest + b } else { rest }),
        Binary::Equal => return Ok(Value::Bool(a == b)),
        Binary::NotEqual => return Ok(Value::Bool(a != b)),
        Binary::Less => return Ok(Value::Bool(a < b)),
        Binary::LessOrEqual => return Ok(Value::Bool(a <= b)),
        Binary::Greater => return Ok(Value::Bool(a > b)),
        Binary::GreaterOrEqual => return Ok(Value::Bool(a >= b)),
        _ => return floats(operator, a as f64, b as f64, meter),
    };
    match value {
        Some(value) => Ok(Value::Int(value)),
        None => {
            Err(format!("the result of `{}` has more than 64 bits; use floats", operator.symbol())
                .into())
        }
    }
}

fn floats(operator: Binary, a: f64, b: f64, meter: &Meter) -> Outcome<Value> {
    Ok(match operator {
        Binary::Add => Value::Float(a + b),
        Binary::Subtract => Value::Float(a - b),
        Binary::Multiply => Value::Float(a * b),
        Binary::Divide | Binary::FloorDivide | Binary::Remainder if b == 0.0 => {
            return Err("division by zero".into());
        }
        Binary::Divide => Value::Float(a / b),
        Binary::FloorDivide => Value::Float((a / b).floor()),
        Binary::Remainder => {
            meter.spend(cost::FUNCTION + exponent(a).saturating_sub(exponent(b)))?;
            let rest = libm::fmod(a, b);
            let rest = if rest != 0.0 && (rest < 0.0) != (b < 0.0) { rest + b } else { rest };
            Value::Float(rest)
        }
        Binary::Equal => Value::Bool(a == b),
        Binary::NotEqual => Value::Bool(a != b),
        Binary::Less => Value::Bool(a < b),
        Binary::LessOrEqual => Value::Bool(a <= b),
        Binary::Greater => Value::Bool(a > b),
        Binary::GreaterOrEqual => Value::Bool(a >= b),
        Binary::In | Binary::NotIn => {
            return Err(format!("`{}` needs a list, dict or string", operator.symbol()).into());
        }
    })
}

/// The stored exponent of a number; `fmod` takes one step per bit of the difference of two
/// exponents.
fn exponent(value: f64) -> usize {
    (value.to_bits() >> 52 & 0x7ff) as usize
}

fn add(a: &Value, b: &Value, meter: &Rc<Meter>) -> Outcome<Value> {
    match (a, b) {
        (Value::Text(_), Value::Text(_)) => {
            let (a, b) = (a.read_text()?.unwrap_or_default(), b.read_text()?.unwrap_or_default());
            Ok(Value::text(&[a, b].concat(), meter)?)
        }
        (Value::List(a_list), Value::List(b_list)) if a.kind() == b.kind() => {
            let mut items = a_list.items()?;
            items.extend(b_list.items()?);
            let new = if a.kind() == "tuple" { Value::tuple } else { Value::list };
            Ok(new(items, meter)?)
        }
        _ => Err(not_for(Binary::Add, a, b)),
    }
}

fn contains(container: &Value, value: &Value, meter: &Rc<Meter>) -> Outcome<bool> {
    match container {
        Value::List(list) => {
            for item in list.items()? {
                if item.equals(value, meter)? {
                    return Ok(true);
                }
            }
            Ok(false)
        }
        Value::Dict(dict) => Ok(dict.get(&dict.key(value)?)?.is_some()),
        Value::Text(_) => {
            let text = container.as_text().unwrap_or_default();
            meter.work(text.len())?;
            match value.as_text() {
                Some(part) if part.len() <= 64 => Ok(text.contains(part)),
                _ => Err("`in` finds only strings of at most 64 bytes in a string".into()),
            }
        }
        _ => {
            Err(format!("`in` needs a list, dict or string, not {}", container.kind_with_article())
                .into())
        }
    }
}

/// The order of two numbers, or of two texts.
pub(crate) fn order(a: &Value, b: &Value, meter: &Meter) -> Outcome<Ordering> {
    match (a, b) {
        (Value::Int(a), Value::Int(b)) => return Ok(a.cmp(b)),
        (Value::Text(_), Value::Text(_)) => {
            let (a, b) = (a.as_text().unwrap_or_default(), b.as_text().unwrap_or_default());
            meter.read(a.len().min(b.len()))?;
            return Ok(a.cmp(b));
        }
        _ => {}
    }
    match (a.number(), b.number()) {
        (Some(x), Some(y)) => x.partial_cmp(&y).ok_or_else(|| without_order(a, b)),
        _ => Err(without_order(a, b)),
    }
}

/// The error for two values without an order.
pub(crate) fn without_order(a: &Value, b: &Value) -> Fault {
    match (a.number(), b.number()) {
        (Some(_), Some(_)) => "NaN (not a number) has no order".into(),
        _ => {
            format!("{} and {} have no order", a.kind_with_article(), b.kind_with_article()).into()
        }
    }
}

/// The elements of a loop: those of a list, or the keys of a dict.
pub(crate) fn elements(value: &Value, meter: &Rc<Meter>) -> Outcome<Vec<Value>> {
    match value {
        Value::List(list) => Ok(list.items()?),
        Value::Dict(dict) => keys(dict, meter),
        _ => Err(format!("expected a list, found {}", value.kind()).into()),
    }
}

fn keys(dict: &Dict, meter: &Rc<Meter>) -> Outcome<Vec<Value>> {
    let keys = dict.keys()?;
    Ok(keys.iter().map(|key| key.value(meter)).collect::<Result<_, _>>()?)
}

/// The position in a list of `n` elements; negative indices count from the end.
pub(crate) fn place(index: &Value, n: usize) -> Outcome<usize> {
    let index = match index {
        Value::Int(index) => *index,
        Value::Float(index) if index.fract() == 0.0 && index.abs() < 1e9 => *index as i64,
        _ => {
            return Err(
                format!("an index is a whole number, not {}", index.kind_with_article()).into()
            );
        }
    };
    let from_start = if index < 0 { index.saturating_add(n as i64) } else { index };
    usize::try_from(from_start)
        .ok()
        .filter(|&place| place < n)
        .ok_or_else(|| format!("there is no element {index} in a list of {n}").into())
}

/// `container[index]`.
pub(crate) fn element(container: &Value, index: &Value) -> Outcome<Value> {
    match container {
        Value::List(list) => {
            let place = place(index, list.len())?;
            Ok(list.get(place).expect("the place is below the length"))
        }
        Value::Dict(dict) => dict.get(&dict.key(index)?)?.ok_or_else(|| {
            format!("the dict has no key {}", shortened(&format!("{index:?}"))).into()
        }),
        _ => Err(format!("{} has no elements", container.kind_with_article()).into()),
    }
}

/// `list[from:to]`.
pub(crate) fn slice(value: &Value, from: &Value, to: &Value, meter: &Rc<Meter>) -> Outcome<Value> {
    let Value::List(list) = value else {
        return Err(format!("{} cannot be sliced", value.kind_with_article()).into());
    };
    let n = list.len();
    let bound = |bound: &Value, default: usize| match bound {
        Value::Nothing => Ok(default),
        Value::Int(index) if *index < 0 => {
            Ok(usize::try_from(index.saturating_add(n as i64)).unwrap_or(0))
        }
        Value::Int(index) => Ok(usize::try_from(*index).unwrap_or(n).min(n)),
        _ => Err(Fault::from(format!(
            "an index is a whole number, not {}",
            bound.kind_with_article()
        ))),
    };
    let (from, to) = (bound(from, 0)?, bound(to, n)?);
    let items = list.items()?;
    let part = items.get(from..to.max(from)).unwrap_or_default().to_vec();
    let new = if value.kind() == "tuple" { Value::tuple } else { Value::list };
    Ok(new(part, meter)?)
}

/// Calls a method of a list or dict.
pub(crate) fn method(
    value: &Value,
    method: Method,
    arguments: &[Value],
    meter: &Rc<Meter>,
) -> Outcome<Value> {
    match value {
        Value::List(list) => list_method(list, method, arguments, meter),
        Value::Dict(dict) => dict_method(dict, method, arguments, meter),
        _ => Err(format!("{} has no `{}`", value.kind_with_article(), method.name()).into()),
    }
}

fn list_method(
    list: &Rc<List>,
    method: Method,
    arguments: &[Value],
    meter: &Rc<Meter>,
) -> Outcome<Value> {
    match (method, arguments) {
        (Method::Append, [value]) => list.insert(list.len(), value.clone())?,
        (Method::Extend, [other]) => {
            for value in elements(other, meter)? {
                list.insert(list.len(), value)?;
            }
        }
        (Method::Insert, [index, value]) => {
            meter.work(list.len() / 8)?;
            let place = match index {
                Value::Int(index) if *index >= list.len() as i64 => list.len(),
                _ => place(index, list.len())?,
            };
            list.insert(place, value.clone())?;
        }
        (Method::Pop, []) => return list.remove(place(&Value::Int(-1), list.len())?),
        (Method::Pop, [index]) => {
            meter.work(list.len() / 8)?;
            return list.remove(place(index, list.len())?);
        }
        (Method::Index, [value]) => {
            for (index, item) in list.items()?.iter().enumerate() {
                if item.equals(value, meter)? {
                    return Ok(Value::Int(index as i64));
                }
            }
            return Err("the list has no such element".into());
        }
        (Method::Clear, []) => list.clear()?,
        (Method::Get | Method::Items | Method::Keys | Method::Values, _) => {
            return Err(format!("a list has no `{}`", method.name()).into());
        }
        _ => return Err(wrong_arguments(method.name(), arguments)),
    }
    Ok(Value::Nothing)
}

fn dict_method(
    dict: &Rc<Dict>,
    method: Method,
    arguments: &[Value],
    meter: &Rc<Meter>,
) -> Outcome<Value> {
    Ok(match (method, arguments) {
        (Method::Get, [key]) => dict.get(&dict.key(key)?)?.unwrap_or(Value::Nothing),
        (Method::Get, [key, default]) => {
            dict.get(&dict.key(key)?)?.unwrap_or_else(|| default.clone())
        }
        (Method::Keys, []) => Value::list(keys(dict, meter)?, meter)?,
        (Method::Values | Method::Items, []) => {
            let mut items = Vec::new();
            for key in dict.keys()? {
                meter.work(1)?;
                let value = dict.get(&key)?.expect("the dict has this key");
                items.push(match method {
                    Method::Values => value,
                    _ => Value::tuple(vec![key.value(meter)?, value], meter)?,
                });
            }
            Value::list(items, meter)?
        }
        (Method::Pop, [key] | [key, _]) => {
            match (dict.remove(&dict.key(key)?)?, arguments.get(1)) {
                (Some(value), _) => value,
                (None, Some(default)) => default.clone(),
                (None, None) => return Err("the dict has no such key".into()),
            }
        }
        (Method::Clear, []) => {
            dict.clear()?;
            Value::Nothing
        }
        (Method::Append | Method::Extend | Method::Insert | Method::Index, _) => {
            return Err(format!("a dict has no `{}`", method.name()).into());
        }
        _ => return Err(wrong_arguments(method.name(), arguments)),
    })
}

fn wrong_arguments(name: &str, arguments: &[Value]) -> Fault {
    format!("`{name}` does not take {} arguments", arguments.len()).into()
}

/// Calls a function that every script has.
pub(crate) fn builtin(function: Builtin, arguments: &[Value], meter: &Rc<Meter>) -> Outcome<Value> {
    let name = function.name();
    meter.spend(cost::FUNCTION)?;
    Ok(match (function, arguments) {
        (Builtin::Abs, [Value::Int(value)]) => match value.checked_abs() {
            Some(value) => Value::Int(value),
            None => Value::Float((*value as f64).abs()),
        },
        (Builtin::Abs, [value]) => Value::Float(number(name, value)?.abs()),
        (Builtin::All, [list]) => Value::Bool(elements(list, meter)?.iter().all(Value::is_true)),
        (Builtin::Any, [list]) => Value::Bool(elements(list, meter)?.iter().any(Value::is_true)),
        (Builtin::Bool, [value]) => Value::Bool(value.is_true()),
        (Builtin::Enumerate, [list]) => {
            let numbered = elements(list, meter)?.into_iter().enumerate();
            let pair = |(index, value)| Value::tuple(vec![Value::Int(index as i64), value], meter);
            Value::list(numbered.map(pair).collect::<Result<_, _>>()?, meter)?
        }
        (Builtin::Fail, _) => return Err(failure(arguments)),
        (Builtin::Float, [Value::Bool(value)]) => Value::Float(f64::from(u8::from(*value))),
        (Builtin::Float, [value]) => Value::Float(number(name, value)?),
        (Builtin::Int, [Value::Bool(value)]) => Value::Int((*value).into()),
        (Builtin::Int, [Value::Int(value)]) => Value::Int(*value),
        (Builtin::Int, [value]) => whole(number(name, value)?.trunc())?,
        (Builtin::Ceil, [value]) => whole(number(name, value)?.ceil())?,
        (Builtin::Floor, [value]) => whole(number(name, value)?.floor())?,
        (Builtin::Len, [Value::List(list)]) => Value::Int(list.len() as i64),
        (Builtin::Len, [Value::Dict(dict)]) => Value::Int(dict.len() as i64),
        (Builtin::List, []) => Value::list(Vec::new(), meter)?,
        (Builtin::List, [list]) => Value::list(elements(list, meter)?, meter)?,
        (Builtin::Min | Builtin::Max, [first, rest @ ..]) if !rest.is_empty() => {
            let wanted = if function == Builtin::Min { Ordering::Less } else { Ordering::Greater };
            let mut best = first;
            for value in rest {
                if order(value, best, meter)? == wanted {
                    best = value;
                }
            }
            best.clone()
        }
        (Builtin::Range, [to]) => range(&Value::Int(0), to, &Value::Int(1), meter)?,
        (Builtin::Range, [from, to]) => range(from, to, &Value::Int(1), meter)?,
        (Builtin::Range, [from, to, step]) => range(from, to, step, meter)?,
        (Builtin::Reversed, [list]) => {
            let mut items = elements(list, meter)?;
            items.reverse();
            Value::list(items, meter)?
        }
        (Builtin::Sum, [list]) => {
            let mut sum = Value::Int(0);
            for value in elements(list, meter)? {
                if value.number().is_none() {
                    return Err(
                        format!("`sum` adds numbers, not {}", value.kind_with_article()).into()
                    );
                }
                sum = binary(Binary::Add, &sum, &value, meter)?;
            }
            sum
        }
        (Builtin::Zip, [a, b]) => {
            let pairs = elements(a, meter)?.into_iter().zip(elements(b, meter)?);
            let pairs = pairs.map(|(a, b)| Value::tuple(vec![a, b], meter));
            Value::list(pairs.collect::<Result<_, _>>()?, meter)?
        }
        (Builtin::Acos, [x]) => Value::Float(libm::acos(number(name, x)?)),
        (Builtin::Asin, [x]) => Value::Float(libm::asin(number(name, x)?)),
        (Builtin::Atan, [x]) => Value::Float(libm::atan(number(name, x)?)),
        (Builtin::Atan2, [y, x]) => Value::Float(libm::atan2(number(name, y)?, number(name, x)?)),
        (Builtin::Cos, [x]) => Value::Float(libm::cos(number(name, x)?)),
        (Builtin::Exp, [x]) => Value::Float(libm::exp(number(name, x)?)),
        (Builtin::Hypot, [x, y]) => {
            let (x, y) = (number(name, x)?, number(name, y)?);
            Value::Float((x * x + y * y).sqrt())
        }
        (Builtin::Log, [x]) => Value::Float(libm::log(number(name, x)?)),
        (Builtin::Pow, [x, y]) => Value::Float(libm::pow(number(name, x)?, number(name, y)?)),
        (Builtin::Sin, [x]) => Value::Float(libm::sin(number(name, x)?)),
        (Builtin::Sqrt, [x]) => Value::Float(number(name, x)?.sqrt()),
        (Builtin::Tan, [x]) => Value::Float(libm::tan(number(name, x)?)),
        (Builtin::Len, [other]) => {
            return Err(format!("{} has no length", other.kind_with_article()).into());
        }
        _ => return Err(wrong_arguments(name, arguments)),
    })
}

fn number(function: &str, value: &Value) -> Outcome<f64> {
    let wrong = || format!("`{function}` takes a number, not {}", value.kind_with_article()).into();
    value.number().ok_or_else(wrong)
}

/// Converts a float without a fraction to a whole number.
fn whole(value: f64) -> Outcome<Value> {
    const LARGEST: f64 = (1_i64 << 62) as f64;
    if value.abs() <= LARGEST {
        Ok(Value::Int(value as i64))
    } else {
        Err(format!("{value} is not a whole number of 64 bits").into())
    }
}

fn range(from: &Value, to: &Value, step: &Value, meter: &Rc<Meter>) -> Outcome<Value> {
    let (Value::Int(from), Value::Int(to), Value::Int(step)) = (from, to, step) else {
        return Err("`range` takes whole numbers; `int(...)` makes one".into());
    };
    if *step == 0 {
        return Err("`range` with step 0 has no end".into());
    }
    let (first, last) = if *step > 0 { (from, to) } else { (to, from) };
    let distance = u64::try_from(i128::from(*last) - i128::from(*first)).unwrap_or(0);
    let n = distance.div_ceil(step.unsigned_abs());
    let n_elements = usize::try_from(n).unwrap_or(usize::MAX);
    meter.work(n_elements)?;
    meter.check_room(n_elements.saturating_mul(ELEMENT))?;
    let numbers =
        (0..n as i64).map(|index| Value::Int(from.wrapping_add(index.wrapping_mul(*step))));
    Ok(Value::list(numbers.collect(), meter)?)
}

/// The words of `fail`, which copies no more of them than a message has.
fn failure(arguments: &[Value]) -> Fault {
    let words = arguments.iter().take(1 + MESSAGE_CHARS).map(|value| match value.as_text() {
        Some(text) => shortened(text),
        None => format!("{value:?}"),
    });
    shortened(&words.collect::<Vec<_>>().join(" ")).into()
}

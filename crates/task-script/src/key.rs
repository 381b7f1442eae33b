//! The keys of dicts.

use std::rc::Rc;

use crate::meter::Meter;
use crate::value::{COMPARED_DEPTH, Object, Value};

/// The keys of dicts.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Key {
    Nothing,
    Bool(bool),
    /// A whole number, or a float with a whole value.
    Int(i64),
    /// The bits of any other float.
    Float(u64),
    Text(String),
    Tuple(Vec<Key>),
    Object(Object),
}

impl Key {
    /// Converts a value to a key.
    pub(crate) fn new(value: &Value) -> Result<Self, String> {
        Self::within(value, COMPARED_DEPTH)
    }

    fn within(value: &Value, depth: usize) -> Result<Self, String> {
        Ok(match value {
            Value::Nothing => Self::Nothing,
            Value::Bool(value) => Self::Bool(*value),
            Value::Int(value) => Self::Int(*value),
            Value::Float(value) => match whole(*value) {
                Some(value) => Self::Int(value),
                None => Self::Float(value.to_bits()),
            },
            Value::Text(_) => Self::Text(value.read_text()?.unwrap_or_default().to_owned()),
            Value::List(list) if list.is_tuple() && depth > 0 => {
                let keys = list.items()?;
                let keys = keys.iter().map(|value| Self::within(value, depth - 1));
                Self::Tuple(keys.collect::<Result<_, _>>()?)
            }
            Value::Object(object) => Self::Object(*object),
            _ => return Err(format!("{} cannot be a key of a dict", value.kind_with_article())),
        })
    }

    /// Bytes of the key on the heap.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Tuple(keys) => keys.iter().map(|key| size_of::<Self>() + key.bytes()).sum(),
            _ => 0,
        }
    }

    /// Converts the key back to a value.
    pub(crate) fn value(&self, meter: &Rc<Meter>) -> Result<Value, String> {
        Ok(match self {
            Self::Nothing => Value::Nothing,
            Self::Bool(value) => Value::Bool(*value),
            Self::Int(value) => Value::Int(*value),
            Self::Float(bits) => Value::Float(f64::from_bits(*bits)),
            Self::Text(text) => Value::text(text, meter)?,
            Self::Tuple(keys) => {
                let values = keys.iter().map(|key| key.value(meter));
                Value::tuple(values.collect::<Result<_, _>>()?, meter)?
            }
            Self::Object(object) => Value::Object(*object),
        })
    }
}

/// Converts a float to a whole number, if it is one.
fn whole(value: f64) -> Option<i64> {
    /// Floats represent every whole number up to this one exactly.
    const EXACT: f64 = (1_i64 << 53) as f64;
    (value.abs() <= EXACT && value.fract() == 0.0).then_some(value as i64)
}

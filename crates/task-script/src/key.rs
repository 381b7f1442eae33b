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
    /// Converts a value to a key. Fails if there is no room for the copy, because a tuple may
    /// contain the same text many times.
    pub(crate) fn new(value: &Value, meter: &Meter) -> Result<Self, String> {
        Self::within(value, COMPARED_DEPTH, &mut Copying { meter, bytes: 0 })
    }

    fn within(value: &Value, depth: usize, copying: &mut Copying<'_>) -> Result<Self, String> {
        Ok(match value {
            Value::Nothing => Self::Nothing,
            Value::Bool(value) => Self::Bool(*value),
            Value::Int(value) => Self::Int(*value),
            Value::Float(value) => match whole(*value) {
                Some(value) => Self::Int(value),
                // Processors differ in the sign of NaN.
                None if value.is_nan() => Self::Float(f64::NAN.to_bits()),
                None => Self::Float(value.to_bits()),
            },
            Value::Text(_) => {
                let text = value.read_text()?.unwrap_or_default();
                copying.grow(text.len())?;
                Self::Text(text.to_owned())
            }
            Value::List(list) if list.is_tuple() && depth > 0 => {
                let keys = list.items()?;
                copying.grow(keys.len() * size_of::<Self>())?;
                let keys = keys.iter().map(|value| Self::within(value, depth - 1, copying));
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

/// The copy of a value that becomes a key.
struct Copying<'m> {
    meter: &'m Meter,
    bytes: usize,
}

impl Copying<'_> {
    fn grow(&mut self, bytes: usize) -> Result<(), String> {
        self.bytes += bytes;
        self.meter.check_room(self.bytes)
    }
}

/// Converts a float to a whole number, if it is one.
fn whole(value: f64) -> Option<i64> {
    /// Floats represent every whole number up to this one exactly.
    const EXACT: f64 = (1_i64 << 53) as f64;
    (value.abs() <= EXACT && value.fract() == 0.0).then_some(value as i64)
}

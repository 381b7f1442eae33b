//! Values of parameters.

use std::fmt;

use serde::{Serialize, Serializer};

use super::{Parameter, Parameters};
use crate::NamedMap;

/// Parameters by key, for instance those of an algorithm. Absent parameters have their defaults.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Params(NamedMap<ParameterValue>);

/// The value of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A whole number.
    Whole(u32),
    /// A number.
    Number(f64),
    /// A whole number of 64 bits.
    Long(u64),
    /// A name, for instance of an operator.
    Name(String),
    /// True or false.
    Switch(bool),
    /// Several numbers.
    Numbers(Vec<f64>),
    /// Several whole numbers.
    Wholes(Vec<u32>),
    /// Several lists of numbers.
    Vectors(Vec<Vec<f64>>),
    /// Several names.
    Names(Vec<String>),
    /// An object.
    Object(Params),
    /// Several objects. A single object is written without a list around it.
    #[serde(serialize_with = "one_or_list")]
    Objects(Vec<Params>),
    /// No value.
    Null,
}

impl Params {
    /// Sets a parameter. A new key goes to the end of the canonical form.
    pub fn set(&mut self, key: &str, value: impl Into<ParameterValue>) {
        self.0.insert(key.to_owned(), value.into());
    }

    /// The same parameters with one of them set.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl Into<ParameterValue>) -> Self {
        self.set(key, value);
        self
    }

    /// The same parameters with another one, unless the canonical form omits it.
    #[must_use]
    pub(crate) fn with_canonical(
        self,
        parameter: &Parameter,
        value: impl Into<ParameterValue>,
    ) -> Self {
        let value = value.into();
        if parameter.is_left_out(&value) { self } else { self.with(parameter.key, value) }
    }

    /// All parameters that are set, in the order of the canonical form.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &ParameterValue)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// The value of `parameter`, or its default; `None` if the algorithm computes the default.
    pub fn get(&self, parameter: &Parameter) -> Option<ParameterValue> {
        self.0.get(parameter.key).cloned().or_else(|| parameter.default.value())
    }

    /// The value of `parameter`, or its default, as a `T`. If the algorithm computes the default,
    /// an option is `None`.
    ///
    /// # Panics
    ///
    /// If the value has another type, which cannot happen, because parameters are checked before
    /// they are used.
    pub fn value_of<T: TryFrom<ParameterValue, Error = ParameterValue>>(
        &self,
        parameter: &Parameter,
    ) -> T {
        typed(parameter.key, self.get(parameter))
    }

    /// The value of a key that is present, as a `T`.
    pub(crate) fn of_key<T: TryFrom<ParameterValue, Error = ParameterValue>>(
        &self,
        key: &str,
    ) -> T {
        typed(key, self.0.get(key).cloned())
    }
}

fn typed<T: TryFrom<ParameterValue, Error = ParameterValue>>(
    key: &str,
    value: Option<ParameterValue>,
) -> T {
    let value = value.unwrap_or(ParameterValue::Null);
    value.try_into().unwrap_or_else(|value| panic!("`{key}` has another type than {value:?}"))
}

fn one_or_list<S: Serializer>(objects: &[Params], serializer: S) -> Result<S::Ok, S::Error> {
    match objects {
        [one] => one.serialize(serializer),
        list => list.serialize(serializer),
    }
}

impl ParameterValue {
    /// The number, whole or not.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Self::Whole(number) => Some(number.into()),
            Self::Number(number) => Some(number),
            _ => None,
        }
    }
}

impl From<&str> for ParameterValue {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

/// Conversions between values of parameters and the types of fields.
macro_rules! types {
    ($($type:ty = $variant:ident,)*) => {$(
        impl From<$type> for ParameterValue {
            fn from(value: $type) -> Self {
                Self::$variant(value)
            }
        }

        impl TryFrom<ParameterValue> for $type {
            type Error = ParameterValue;

            fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
                match value {
                    ParameterValue::$variant(value) => Ok(value),
                    other => Err(other),
                }
            }
        }
    )*};
}

types! {
    u32 = Whole,
    f64 = Number,
    String = Name,
    bool = Switch,
    Vec<f64> = Numbers,
    Vec<Vec<f64>> = Vectors,
    Vec<String> = Names,
    Params = Object,
}

impl From<u64> for ParameterValue {
    fn from(number: u64) -> Self {
        number.try_into().map_or(Self::Long(number), Self::Whole)
    }
}

impl TryFrom<ParameterValue> for u64 {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Whole(number) => Ok(number.into()),
            ParameterValue::Long(number) => Ok(number),
            other => Err(other),
        }
    }
}

impl From<[f64; 2]> for ParameterValue {
    fn from(pair: [f64; 2]) -> Self {
        Self::Numbers(pair.to_vec())
    }
}

impl TryFrom<ParameterValue> for [f64; 2] {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        Vec::try_from(value)?.try_into().map_err(ParameterValue::Numbers)
    }
}

impl From<Vec<[f64; 2]>> for ParameterValue {
    fn from(points: Vec<[f64; 2]>) -> Self {
        Self::Vectors(points.into_iter().map(Vec::from).collect())
    }
}

impl TryFrom<ParameterValue> for Vec<[f64; 2]> {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        let vectors = Vec::<Vec<f64>>::try_from(value)?;
        let points: Option<Self> =
            vectors.iter().map(|vector| vector.as_slice().try_into().ok()).collect();
        points.ok_or(ParameterValue::Vectors(vectors))
    }
}

impl<T: Parameters> From<Vec<T>> for ParameterValue {
    fn from(objects: Vec<T>) -> Self {
        Self::Objects(objects.iter().map(T::to_params).collect())
    }
}

impl<T: Parameters> TryFrom<ParameterValue> for Vec<T> {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Null => Ok(Self::new()),
            ParameterValue::Objects(objects) => Ok(objects.iter().map(T::from_params).collect()),
            other => Err(other),
        }
    }
}

impl<T: Into<Self>> From<Option<T>> for ParameterValue {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Null, T::into)
    }
}

impl<T: TryFrom<ParameterValue, Error = ParameterValue>> TryFrom<ParameterValue> for Option<T> {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Null => Ok(None),
            other => T::try_from(other).map(Some),
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(number) => write!(f, "{number}"),
            Self::Long(number) => write!(f, "{number}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Switch(switch) => write!(f, "{switch}"),
            Self::Numbers(numbers) => write!(f, "{numbers:?}"),
            Self::Wholes(numbers) => write!(f, "{numbers:?}"),
            Self::Vectors(vectors) => write!(f, "{vectors:?}"),
            Self::Names(names) => write!(f, "`{}`", names.join("`, `")),
            Self::Object(_) | Self::Objects(_) => f.write_str("an object"),
            Self::Null => f.write_str("null"),
        }
    }
}

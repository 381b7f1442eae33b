//! The values of an algorithm's parameters.

use std::fmt;

use serde::Serialize;

use super::Parameter;
use crate::NamedMap;

/// The parameters of an algorithm, by key. Those that are absent have their
/// defaults.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub struct AlgorithmParams(NamedMap<ParameterValue>);

/// The value of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParameterValue {
    /// A whole number.
    Whole(u32),
    /// A number.
    Number(f64),
    /// A name, for instance of an operator.
    Name(String),
}

impl AlgorithmParams {
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

    /// All parameters that are set, in the order of the canonical form.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &ParameterValue)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// The value of `parameter`, or its default; none if it has neither because
    /// the algorithm computes its default.
    pub fn get(&self, parameter: &Parameter) -> Option<ParameterValue> {
        self.0.get(parameter.key).cloned().or_else(|| parameter.default.value())
    }

    /// The value of a parameter that is a number; none if the algorithm computes
    /// its default and nothing else is set.
    ///
    /// # Panics
    ///
    /// If the value is not a number: parameters are checked before they are used.
    pub fn optional_number(&self, parameter: &Parameter) -> Option<f64> {
        self.get(parameter).map(|value| match value {
            ParameterValue::Number(number) => number,
            other => panic!("`{}` is checked to be a number, is {other:?}", parameter.key),
        })
    }

    /// The value of a parameter that is a number and has a default.
    ///
    /// # Panics
    ///
    /// If it has no default, or is not a number.
    pub fn number(&self, parameter: &Parameter) -> f64 {
        self.optional_number(parameter).expect("the parameter has a default")
    }

    /// The value of a parameter that is a whole number.
    ///
    /// # Panics
    ///
    /// If the value is not a whole number.
    pub fn whole(&self, parameter: &Parameter) -> u32 {
        match self.get(parameter) {
            Some(ParameterValue::Whole(number)) => number,
            other => panic!("`{}` is checked to be whole, is {other:?}", parameter.key),
        }
    }

    /// The value of a parameter that is a name.
    ///
    /// # Panics
    ///
    /// If the value is not a name.
    pub fn name(&self, parameter: &Parameter) -> String {
        match self.get(parameter) {
            Some(ParameterValue::Name(name)) => name,
            other => panic!("`{}` is checked to be a name, is {other:?}", parameter.key),
        }
    }
}

impl From<f64> for ParameterValue {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<u32> for ParameterValue {
    fn from(number: u32) -> Self {
        Self::Whole(number)
    }
}

impl From<&str> for ParameterValue {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(number) => write!(f, "{number}"),
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "`{name}`"),
        }
    }
}

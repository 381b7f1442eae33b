//! Numbers that are not NaN.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A number that is not NaN. Stored and displayed fitness uses this type, so that no NaN reaches a
/// database. Statistics of finite fitness are finite; databases of older versions have infinite
/// statistics where sums overflowed.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Real(f64);

/// The value is NaN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("NaN instead of a number")]
pub struct NotANumber;

impl Real {
    /// `None` if `value` is NaN.
    pub const fn new(value: f64) -> Option<Self> {
        if value.is_nan() { None } else { Some(Self(value)) }
    }

    /// `None` if `value` is NaN or infinite.
    pub const fn finite(value: f64) -> Option<Self> {
        if value.is_finite() { Some(Self(value)) } else { None }
    }

    /// The number.
    pub const fn get(self) -> f64 {
        self.0
    }
}

impl From<Real> for f64 {
    fn from(value: Real) -> Self {
        value.0
    }
}

impl TryFrom<f64> for Real {
    type Error = NotANumber;

    fn try_from(value: f64) -> Result<Self, NotANumber> {
        Self::new(value).ok_or(NotANumber)
    }
}

impl PartialEq<f64> for Real {
    fn eq(&self, other: &f64) -> bool {
        self.0 == *other
    }
}

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

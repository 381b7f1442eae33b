//! The experiments that a command applies to.

use std::{
    fmt::{self, Display},
    str::FromStr,
};

use model::group;

/// The subject of a command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    Experiment(u64),
    Group(String),
}

impl Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Experiment(id) => id.fmt(f),
            Self::Group(name) => name.fmt(f),
        }
    }
}

impl FromStr for Subject {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(id) = text.parse() {
            return Ok(Self::Experiment(id));
        }
        group::check_name(text)?;
        Ok(Self::Group(text.to_owned()))
    }
}

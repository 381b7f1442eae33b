//! Finds unit variants of an enum by their `serde` names, so that no second list of names can
//! differ from the types.

use std::fmt;

use serde::Deserialize;
use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeOwned, IntoDeserializer as _};

/// The variant of this name.
pub(crate) fn variant<'a, T: Deserialize<'a>>(name: &'a str) -> Result<T, UnknownVariant> {
    let deserializer: StrDeserializer<'a, UnknownVariant> = name.into_deserializer();
    T::deserialize(deserializer)
}

/// The names of all variants.
pub(crate) fn names<T: DeserializeOwned>() -> &'static [&'static str] {
    variant::<T>("").err().map_or(&[], |error| error.expected)
}

/// The name belongs to no variant.
#[derive(Debug)]
pub(crate) struct UnknownVariant {
    /// The names of all variants.
    pub(crate) expected: &'static [&'static str],
}

impl de::Error for UnknownVariant {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self { expected: &[] }
    }

    fn unknown_variant(_: &str, expected: &'static [&'static str]) -> Self {
        Self { expected }
    }
}

impl std::error::Error for UnknownVariant {}

impl fmt::Display for UnknownVariant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "none of {:?}", self.expected)
    }
}

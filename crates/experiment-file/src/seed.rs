//! Seeds in JSON: a number if every program reads it exactly, otherwise text.

use std::{borrow::Cow, fmt};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Largest seed that is a number in JSON, because JavaScript and jq round larger ones.
const NUMBER_MAX: u64 = 1 << 53;

/// A seed in JSON answers and files of results. Seeds from 2^53 + 1 on are written as a text of
/// digits. Both forms can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seed(pub u64);

impl Seed {
    /// Reads a seed from its digits.
    pub fn from_digits(text: &str) -> Option<Self> {
        let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse().ok().filter(|_| is_plain).map(Self)
    }
}

impl JsonSchema for Seed {
    fn schema_name() -> Cow<'static, str> {
        "Seed".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A seed: a number up to 2^53, or a larger one as a text of its digits.",
            "oneOf": [
                {"type": "integer", "minimum": 0, "maximum": NUMBER_MAX},
                {"type": "string", "pattern": "^[0-9]{16,20}$"},
            ],
        })
    }
}

impl Serialize for Seed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.0 <= NUMBER_MAX {
            serializer.serialize_u64(self.0)
        } else {
            serializer.collect_str(&self.0)
        }
    }
}

impl<'de> Deserialize<'de> for Seed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Digits)
    }
}

/// Reads a number, or its digits as text.
struct Digits;

impl de::Visitor<'_> for Digits {
    type Value = Seed;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a whole number from 0 to {}, or a text of its digits", u64::MAX)
    }

    fn visit_u64<E: de::Error>(self, number: u64) -> Result<Seed, E> {
        Ok(Seed(number))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Seed, E> {
        Seed::from_digits(text).ok_or_else(|| E::invalid_value(de::Unexpected::Str(text), &self))
    }
}

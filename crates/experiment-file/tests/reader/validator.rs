//! The part of JSON Schema (draft 2020-12) that the schema of experiment files uses.
//!
//! A full validator with its forty dependencies takes as long to compile as this crate. This one
//! panics at unknown keywords, so it ignores none.

use regex_lite::Regex;
use serde_json::{Map, Value};

/// The conflicts of a value with a schema; empty if it fits.
pub fn problems(root: &Value, value: &Value) -> Vec<String> {
    Validator { root }.problems(root, value, "")
}

/// Whether a value fits a schema.
pub fn is_valid(root: &Value, value: &Value) -> bool {
    problems(root, value).is_empty()
}

/// Whether a value fits a part of a schema.
pub fn fits(root: &Value, part: &Value, value: &Value) -> bool {
    Validator { root }.problems(part, value, "").is_empty()
}

struct Validator<'a> {
    root: &'a Value,
}

impl Validator<'_> {
    fn problems(&self, schema: &Value, value: &Value, at: &str) -> Vec<String> {
        let schema = match schema {
            Value::Bool(true) => return Vec::new(),
            Value::Bool(false) => return vec![format!("{at}: nothing may be here")],
            Value::Object(schema) => schema,
            other => panic!("no schema: {other}"),
        };
        schema.iter().flat_map(|entry| self.keyword(schema, entry, value, at)).collect()
    }

    fn keyword(
        &self,
        schema: &Map<String, Value>,
        (keyword, argument): (&String, &Value),
        value: &Value,
        at: &str,
    ) -> Vec<String> {
        let number = |fits: fn(f64, f64) -> bool| {
            value.as_f64().is_none_or(|value| fits(value, argument.as_f64().unwrap()))
        };
        let len = |len: Option<usize>, fits: fn(u64, u64) -> bool| {
            len.is_none_or(|len| fits(len as u64, argument.as_u64().unwrap()))
        };
        let (n_keys, n_items) = (value.as_object().map(Map::len), value.as_array().map(Vec::len));
        let n_fitting = || {
            let schemas = argument.as_array().unwrap().iter();
            schemas.filter(|schema| self.problems(schema, value, at).is_empty()).count()
        };
        let fits = match keyword.as_str() {
            "$defs" | "$schema" | "default" | "description" | "format" | "title" => true,
            "$ref" => {
                let path = argument.as_str().unwrap().strip_prefix('#').unwrap();
                return self.problems(self.root.pointer(path).unwrap(), value, at);
            }
            "type" => match argument {
                Value::Array(types) => types.iter().any(|name| has_type(value, name)),
                name => has_type(value, name),
            },
            "const" => equal(value, argument),
            "enum" => argument.as_array().unwrap().iter().any(|one| equal(value, one)),
            "minimum" => number(|value, bound| value >= bound),
            "maximum" => number(|value, bound| value <= bound),
            "exclusiveMinimum" => number(|value, bound| value > bound),
            "exclusiveMaximum" => number(|value, bound| value < bound),
            "minItems" => len(n_items, |len, bound| len >= bound),
            "maxItems" => len(n_items, |len, bound| len <= bound),
            "minProperties" => len(n_keys, |len, bound| len >= bound),
            "maxProperties" => len(n_keys, |len, bound| len <= bound),
            "pattern" => {
                let pattern = Regex::new(argument.as_str().unwrap()).unwrap();
                value.as_str().is_none_or(|value| pattern.is_match(value))
            }
            "anyOf" => n_fitting() > 0,
            "oneOf" => n_fitting() == 1,
            "required" => value.as_object().is_none_or(|value| {
                let keys = argument.as_array().unwrap();
                keys.iter().all(|key| value.contains_key(key.as_str().unwrap()))
            }),
            "properties" | "additionalProperties" => {
                let of = schema.get("properties").and_then(Value::as_object);
                let schema_of = |key: &String| match (keyword.as_str(), of) {
                    ("properties", _) => argument.get(key),
                    (_, Some(of)) if of.contains_key(key) => None,
                    _ => Some(argument),
                };
                return (value.as_object().into_iter().flatten())
                    .filter_map(|(key, value)| Some((key, value, schema_of(key)?)))
                    .flat_map(|(key, value, of)| self.problems(of, value, &format!("{at}/{key}")))
                    .collect();
            }
            "items" => {
                return (value.as_array().into_iter().flatten().enumerate())
                    .flat_map(|(i, value)| self.problems(argument, value, &format!("{at}/{i}")))
                    .collect();
            }
            unknown => panic!("the validator does not know `{unknown}`"),
        };
        if fits { Vec::new() } else { vec![format!("{at}: {value} and {keyword} {argument}")] }
    }
}

/// Whether a value has a type that a schema names. An integer is a number without
/// fraction, however it is written.
fn has_type(value: &Value, name: &Value) -> bool {
    match name.as_str().unwrap() {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|value| value.fract() == 0.0),
        unknown => panic!("the validator does not know the type `{unknown}`"),
    }
}

/// Equality by value: 1 and 1.0 are the same number.
fn equal(a: &Value, b: &Value) -> bool {
    a == b || a.is_number() && b.is_number() && a.as_f64() == b.as_f64()
}

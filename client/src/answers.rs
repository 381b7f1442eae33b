//! The JSON Schemas of what commands print with `--output json`.

use schemars::{
    JsonSchema, Schema, SchemaGenerator,
    generate::SchemaSettings,
    transform::{Transform, transform_subschemas},
};
use serde_json::{Value, json};

use crate::{commands::schema::Explained, error::Answer};

/// How an answer is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// One value.
    Document,
    /// The last line of standard error, after remarks for people.
    LastLine,
}

impl Form {
    fn about(self) -> &'static str {
        match self {
            Self::Document => "One JSON document.",
            Self::LastLine => "The last line of standard error.",
        }
    }
}

/// What a command prints.
struct Printed {
    command: &'static str,
    form: Form,
    schema: fn(&mut SchemaGenerator) -> Schema,
}

const fn document<T: JsonSchema>(command: &'static str) -> Printed {
    Printed { command, form: Form::Document, schema: SchemaGenerator::subschema_for::<T> }
}

/// All answers for programs, in the order of their names.
const PRINTED: &[Printed] = &[
    Printed {
        command: "error",
        form: Form::LastLine,
        schema: SchemaGenerator::subschema_for::<Answer>,
    },
    document::<Explained>("schema"),
];

/// The names for which there is a schema: commands, and `error`.
pub fn names() -> impl Iterator<Item = &'static str> {
    PRINTED.iter().map(|printed| printed.command)
}

/// The schema of what a command prints.
pub fn schema_of(name: &str) -> Option<Value> {
    let Printed { command, form, schema } =
        PRINTED.iter().find(|printed| printed.command == name)?;
    let mut generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let found = schema(&mut generator);
    let mut whole = Schema::default();
    whole.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
    whole.insert("title".into(), json!(format!("swarmctl {command} --output json")));
    whole.insert("description".into(), json!(form.about()));
    for (key, value) in found.to_value().as_object().into_iter().flatten() {
        whole.insert(key.clone(), value.clone());
    }
    let definitions = generator.take_definitions(true);
    if !definitions.is_empty() {
        whole.insert("$defs".into(), Value::Object(definitions));
    }
    Exact.transform(&mut whole);
    Some(whole.to_value())
}

/// Forbids keys that a schema does not name. Allows null where a number may not be finite.
struct Exact;

impl Transform for Exact {
    fn transform(&mut self, schema: &mut Schema) {
        self.close(schema, true);
    }
}

impl Exact {
    fn close(&mut self, schema: &mut Schema, is_whole: bool) {
        if schema.get("type") == Some(&json!("number")) {
            schema.insert("type".into(), json!(["number", "null"]));
        }
        let has = |key: &str| schema.get(key).is_some();
        let has_parts = ["oneOf", "anyOf", "allOf"].into_iter().any(has);
        if is_whole && has("properties") && !has("additionalProperties") {
            let key = if has_parts { "unevaluatedProperties" } else { "additionalProperties" };
            schema.insert(key.into(), json!(false));
        }
        // The parts of an object are open, because the whole is closed.
        let is_open = has_parts && schema.get("properties").is_some();
        let mut inner = |part: &mut Schema| self.close(part, true);
        if !is_open {
            transform_subschemas(&mut inner, schema);
            return;
        }
        for key in ["oneOf", "anyOf", "allOf"] {
            if let Some(Value::Array(parts)) = schema.get_mut(key) {
                for part in parts {
                    if let Ok(part) = <&mut Schema>::try_from(part) {
                        self.close(part, false);
                    }
                }
            }
        }
        if let Some(Value::Object(properties)) = schema.get_mut("properties") {
            for value in properties.values_mut() {
                if let Ok(part) = <&mut Schema>::try_from(value) {
                    self.close(part, true);
                }
            }
        }
    }
}

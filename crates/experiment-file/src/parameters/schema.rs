//! The JSON Schema of parameters.

use schemars::{Schema, SchemaGenerator, json_schema};
use serde_json::{Map, Value, json};

use super::{DefaultValue, Domain, Parameter, ParameterValue, Table};
use crate::{limits, schema};

/// The schema of an object with the parameters of a table.
pub(crate) fn object(table: &Table, meaning: &str, generator: &mut SchemaGenerator) -> Schema {
    let mut properties = properties(table.parameters, generator);
    for parameter in table.checked {
        let mut schema = parameter.values(generator);
        schema["description"] = json!(format!("{}.", parameter.meaning));
        properties.insert(parameter.key.to_owned(), schema);
    }
    for key in table.ignored.iter().flat_map(|(keys, _)| *keys) {
        properties.insert((*key).to_owned(), json!({"description": "Accepted and ignored."}));
    }
    let mut schema = json_schema!({"type": "object", "additionalProperties": false});
    let required = table.parameters.iter().filter(|parameter| parameter.is_required());
    let required: Vec<&str> = required.map(|parameter| parameter.key).collect();
    if !required.is_empty() {
        schema.insert("required".to_owned(), json!(required));
    }
    if !properties.is_empty() {
        schema.insert("properties".to_owned(), properties.into());
    }
    if !meaning.is_empty() {
        schema.insert("description".to_owned(), json!(meaning.trim()));
    }
    schema
}

/// Adds a key that is no parameter to the schema of an object.
pub(crate) fn add_part(
    object: &mut Schema,
    key: &str,
    meaning: &str,
    is_required: bool,
    mut schema: Schema,
) {
    schema.insert("description".to_owned(), json!(meaning.trim()));
    schema::add_property(object, key, schema.to_value());
    if is_required && let Some(required) = object.ensure_object().get_mut("required") {
        required.as_array_mut().into_iter().for_each(|required| required.push(json!(key)));
    } else if is_required {
        object.insert("required".to_owned(), json!([key]));
    }
}

/// The schema of each key of a table.
pub(crate) fn properties(
    table: &[Parameter],
    generator: &mut SchemaGenerator,
) -> Map<String, Value> {
    let mut properties = Map::new();
    for parameter in table {
        properties.insert(parameter.key.to_owned(), parameter.schema(generator));
        if let Some(also) = parameter.also {
            let mut schema = number(least(parameter.domain), also.max);
            schema["description"] = json!(also.meaning);
            properties.insert(also.key.to_owned(), schema);
        }
    }
    properties
}

impl Parameter {
    /// Whether a file must have the key.
    pub(super) fn is_required(&self) -> bool {
        matches!(self.default, DefaultValue::Required)
    }

    fn schema(&self, generator: &mut SchemaGenerator) -> Value {
        let mut schema = self.values(generator);
        schema["description"] = json!(self.description());
        let default = self.default.value();
        if let Some(default) = default.filter(|v| self.is_nullable || *v != ParameterValue::Null) {
            schema["default"] = json!(default);
        } else if matches!(self.domain, Domain::WholeOrAll(_)) {
            schema["default"] = json!("all");
        }
        schema
    }

    fn values(&self, generator: &mut SchemaGenerator) -> Value {
        let mut schema = match self.domain {
            Domain::Positive => number(least(self.domain), limits::MAGNITUDE),
            Domain::Between(min, max) if min == max => json!({"const": min as i64}),
            Domain::Between(min, max) => number(min, max),
            Domain::Seed => schema::seed(generator).to_value(),
            Domain::Whole(min, max) => whole(min, max),
            Domain::BelowPopulationSize => whole(0, limits::POPULATION),
            Domain::WholeOrAll(max) => json!({"anyOf": [whole(0, max), {"const": "all"}]}),
            Domain::OneOf { names, .. } => json!({"enum": names}),
            Domain::Variant(variants) => (variants.schema)(generator).to_value(),
            Domain::Text => json!({"type": "string"}),
            Domain::Switch => json!({"type": "boolean"}),
            Domain::Numbers(min, max) => list(quantity(), min, max),
            // The lengths depend on other parts of the file.
            Domain::Vectors(max) => list(list(quantity(), 1, 2), 1, max),
            Domain::Points(min, max) => points_schema(min, max),
            Domain::Drawn(min, max) => drawn(number(min, max)),
            Domain::DrawnWhole(min, max) => drawn(whole(min, max)),
            Domain::Certain => whole(0, u32::MAX),
            Domain::Names => schema::names(generator).to_value(),
            Domain::Object(object) => (object.schema)(generator).to_value(),
            Domain::Objects(object, max) => {
                let object = (object.schema)(generator).to_value();
                json!({"anyOf": [object, list(object.clone(), 1, max)]})
            }
        };
        if self.is_nullable && schema["type"].is_string() {
            schema["type"] = json!([schema["type"], "null"]);
        } else if self.is_nullable {
            schema = json!({"anyOf": [schema, {"type": "null"}]});
        }
        schema
    }
}

/// The lower bound of a second key for the quantity of a parameter.
fn least(domain: Domain) -> f64 {
    if matches!(domain, Domain::Positive) { limits::MAGNITUDE.recip() } else { 0.0 }
}

fn number(min: f64, max: f64) -> Value {
    // People read this bound as "above 0".
    if min == limits::MAGNITUDE.recip() {
        json!({"type": "number", "exclusiveMinimum": 0, "maximum": max})
    } else {
        json!({"type": "number", "minimum": min, "maximum": max})
    }
}

fn quantity() -> Value {
    number(-limits::MAGNITUDE, limits::MAGNITUDE)
}

/// Of a list of points `[x, y]`.
pub(crate) fn points_schema(min: usize, max: usize) -> Value {
    list(list(quantity(), 2, 2), min, max)
}

/// Of a number, or a range.
fn drawn(number: Value) -> Value {
    json!({"anyOf": [number, list(number.clone(), 2, 2)]})
}

/// Of a list.
pub(crate) fn list(items: Value, min: usize, max: usize) -> Value {
    json!({"type": "array", "items": items, "minItems": min, "maxItems": max})
}

fn whole(min: u32, max: u32) -> Value {
    json!({"type": "integer", "minimum": min, "maximum": max})
}

//! The JSON Schema of experiment files, for editors and other programs.
//!
//! It is derived from the types, which describe the canonical form. Attributes on them add the
//! further forms of a file (omitted keys, other notations, keys of SpikeSwarmSim), with
//! the functions defined here.

mod key;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema, schema_for};
use serde_json::{Map, Value, json};

use super::description::describe_algorithms;
use super::{
    AlgorithmDescription, ExperimentConfig, NamedAreaParams, NeuronModel, Parameters as _, limits,
    parameters, suggestion,
};

pub use key::{Allowed, Alternative, KeyFacts, UnknownKey, explain_key};

/// Describes the format that [`ExperimentConfig::from_json`] reads (JSON Schema, draft 2020-12).
/// Only the reader checks relations that a schema cannot express (names that resolve, sizes that
/// agree, costs). `algorithms`: the algorithms that a file may name.
pub fn json_schema(algorithms: &[AlgorithmDescription]) -> Value {
    let mut schema = schema_for!(ExperimentConfig).to_value();
    describe_algorithms(&mut schema, algorithms);
    schema
}

/// A placeholder that the descriptions of the algorithms fill in.
pub(super) fn filled_in(_: &mut SchemaGenerator) -> Schema {
    json_schema!({})
}

/// Splits a list of keys such as "a, b", because attributes cannot contain arrays.
pub(super) fn split(keys: &'static str) -> impl Iterator<Item = &'static str> {
    keys.split(", ")
}

/// Keys that may be left out; so may `params` if nothing in it is required.
pub(super) fn optional(keys: &'static str) -> impl Fn(&mut Schema) {
    move |schema| {
        not_required(schema.ensure_object(), keys);
        let params = schema.pointer_mut("/properties/params").and_then(Value::as_object_mut);
        if let Some(params) = params {
            not_required(params, keys);
            if !params.contains_key("required") {
                not_required(schema.ensure_object(), "params");
            }
        }
    }
}

fn not_required(schema: &mut Map<String, Value>, keys: &'static str) {
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        required.retain(|key| !split(keys).any(|optional| key == optional));
        if required.is_empty() {
            schema.remove("required");
        }
    }
}

/// A key that the type lacks.
pub(super) fn property(key: &str, value: Value) -> impl Fn(&mut Schema) {
    move |schema| add_property(schema, key, value.clone())
}

/// Keys without effect.
pub(super) fn ignored(keys: &'static str) -> impl Fn(&mut Schema) {
    move |schema| {
        for key in split(keys) {
            add_property(schema, key, json!({"description": "Accepted and ignored."}));
        }
    }
}

pub(super) fn add_property(schema: &mut Schema, key: &str, value: Value) {
    let properties = schema.ensure_object().entry("properties").or_insert_with(|| json!({}));
    if let Value::Object(properties) = properties {
        properties.insert(key.to_owned(), value);
    }
}

/// Another name of a variant.
pub(super) fn also(name: &str, variant: &str) -> impl Fn(&mut Schema) {
    move |schema| {
        if let Some(Value::Array(variants)) = schema.get_mut("oneOf") {
            let meaning = format!("Another name of `{variant}`.");
            variants.push(json!({"type": "string", "const": name, "description": meaning}));
        }
    }
}

/// A variant without its parameters, or null for none.
pub(super) fn or_name_or_null(schema: &mut Schema) {
    let variants = schema.get("oneOf").and_then(Value::as_array);
    let names = variants.into_iter().flatten().filter_map(|v| v.pointer("/properties/name/const"));
    let names: Vec<Value> = names.cloned().collect();
    if let Some(Value::Array(variants)) = schema.get_mut("oneOf") {
        variants.push(json!({"enum": names}));
        variants.push(json!({"type": "null"}));
    }
}

/// Ground areas by the names that they have in SpikeSwarmSim, with their colours.
pub(super) fn food_areas_and_nests(schema: &mut Schema) {
    let Some(Value::Array(variants)) = schema.get_mut("oneOf") else { return };
    let is_area =
        |variant: &&Value| variant.pointer("/properties/type/const") == Some(&json!("ground_area"));
    let Some(area) = variants.iter().find(is_area).cloned() else { return };
    for (name, description) in [
        ("food_area", "A green ground area, which `food_area_sensor` sees."),
        ("nest", "A black ground area, which `nest_sensor` sees."),
    ] {
        let mut variant = area.clone();
        variant["properties"]["type"]["const"] = json!(name);
        variant["description"] = json!(description);
        let table = &NamedAreaParams::TABLE;
        variant["properties"]["params"] =
            parameters::object(table, "Radius.", &mut SchemaGenerator::default()).to_value();
        variants.push(variant);
    }
}

/// A map from names that the file chooses to values.
pub(super) fn map<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    let entry = generator.subschema_for::<T>();
    json_schema!({
        "type": "object",
        "additionalProperties": entry,
        "minProperties": 1,
        "maxProperties": limits::ENTRIES,
    })
}

/// Adds `neurons`, another form of the neuron model.
pub(super) fn with_neurons(schema: &mut Schema) {
    add_property(schema, "neurons", neurons());
}

/// One name, or several.
pub(super) fn names(_: &mut SchemaGenerator) -> Schema {
    let name = json!({"type": "string"});
    json_schema!({"anyOf": [
        name,
        {"type": "array", "items": name, "minItems": 1, "maxItems": limits::ENTRIES},
    ]})
}

/// One number for all queries, or one each.
pub(super) fn number_or_numbers(_: &mut SchemaGenerator) -> Schema {
    let number = json!({"type": "number"});
    json_schema!({"anyOf": [number, {"type": "array", "items": number}]})
}

/// A whole number of 64 bits, or a text of its digits.
pub(super) fn seed(_: &mut SchemaGenerator) -> Schema {
    json_schema!({"anyOf": [
        {"type": "integer", "format": "uint64", "minimum": 0},
        {"type": "string", "pattern": "^[0-9]+$"},
    ]})
}

/// The path of a script, which `swarmctl` reads, or the script itself.
pub(super) fn script(_: &mut SchemaGenerator) -> Schema {
    json_schema!({"anyOf": [
        {"type": "string", "description": "Path of the script, from the experiment file."},
        {
            "type": "object",
            "properties": {
                "name": {"type": "string", "description": "Name of the script's file."},
                "text": {"type": "string", "description": "The whole script, at most 32 KiB."},
            },
            "required": ["name", "text"],
            "additionalProperties": false,
        },
    ]})
}

/// The schema of the key that names the schema.
pub(super) fn place_of_schema() -> Value {
    json!({"type": "string", "description": "Path of the JSON Schema, for editors."})
}

/// The schema of a key of SpikeSwarmSim that may name the experiment.
pub(super) fn checkpoint_file() -> Value {
    json!({
        "type": ["string", "null"],
        "description": "Name of the experiment if there is no `name`.",
    })
}

/// The schema of the key that chooses the defaults.
pub(super) fn semantics() -> Value {
    json!({
        "enum": ["thesis", "original"],
        "default": "thesis",
        "description": "The defaults of keys that the file leaves out: those of the \
                        thesis, or those of SpikeSwarmSim.",
    })
}

/// The neuron model in the form of Appendix A.
fn neurons() -> Value {
    json!({
        "type": "object",
        "description": "The neuron model in another form, in place of `neuron_model`.",
        "properties": {
            "model": {"enum": NeuronModel::names(), "description": "Name of the neuron model."},
        },
        "required": ["model"],
        "additionalProperties": false,
    })
}

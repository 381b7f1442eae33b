//! Reads the names and keys of the page's sections from the schema.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

use super::description::{Description, sentence};
use super::parts::Section;

/// The schema's description of keys that concern SpikeSwarmSim alone.
const IGNORED: &str = "Accepted and ignored.";
/// Keys of a population that do not depend on the algorithm.
const OF_POPULATION: [&str; 4] = ["objects", "min_vals", "max_vals", "params"];
/// Keys that hold the name of a variant.
const TAGS: [&str; 3] = ["name", "scheme", "type"];

/// The JSON Schema of experiment files.
pub struct Schema(Value);

/// One of the alternatives that a place allows.
pub struct Variant {
    /// Its name; empty if there is no alternative.
    pub label: String,
    pub meaning: String,
    pub keys: Vec<Key>,
    /// Keys without effect.
    pub ignored: Vec<Key>,
}

/// A row of a table.
#[derive(Clone)]
pub struct Key {
    pub name: String,
    pub values: String,
    pub default: String,
    pub meaning: String,
    /// The variants that have it.
    pub of: Vec<String>,
}

impl Key {
    /// Whether the two differ at most in their owners.
    pub fn is_same(&self, other: &Self) -> bool {
        let row = |key: &Self| {
            [&key.name, &key.values, &key.default, &key.meaning].map(|text| text.to_owned())
        };
        row(self) == row(other)
    }
}

impl Schema {
    pub fn new(mut schema: Value) -> Self {
        // The parameters of algorithms have a section of their own.
        let population = schema["$defs"]["PopulationConfig"]["properties"].as_object_mut();
        population.unwrap().retain(|key, _| OF_POPULATION.contains(&&**key));
        Self(schema)
    }

    /// A part by its path below the definitions.
    pub fn part(&self, path: &str) -> &Value {
        if path.is_empty() {
            return &self.0;
        }
        let part = self.0.pointer(&format!("/$defs/{path}"));
        part.unwrap_or_else(|| panic!("the schema has no {path}"))
    }

    /// The target of a reference, or the value itself if it is none.
    pub fn resolved<'a>(&'a self, value: &'a Value) -> &'a Value {
        match value["$ref"].as_str() {
            Some(reference) => self.part(reference.trim_start_matches("#/$defs/")),
            None => value,
        }
    }

    /// The description of a section as a whole.
    pub fn meaning(&self, section: &Section) -> String {
        match section.parts {
            [("", _)] => String::new(),
            [(path, _)] => sentence(self.part(path)),
            _ => String::new(),
        }
    }

    /// The form of a variant with parameters in a file.
    pub fn form(&self, section: &Section) -> Option<String> {
        let [(path, _)] = section.parts else { return None };
        let properties = &self.part(path)["oneOf"][0]["properties"];
        let tag = TAGS.into_iter().find(|tag| properties[tag].is_object())?;
        let rest = if tag == "type" { "KEY: VALUE" } else { "\"params\": {KEY: VALUE}" };
        Some(format!("`{{\"{tag}\": NAME, {rest}}}`"))
    }

    /// The alternatives that the place of a section allows.
    pub fn variants(&self, section: &Section) -> Vec<Variant> {
        let mut variants = Vec::new();
        for &(path, label) in section.parts {
            let part = self.part(path);
            if let Some(titled) = part.as_array() {
                variants.extend(
                    titled.iter().map(|part| {
                        self.variant(part["title"].as_str().expect("a title"), "", part)
                    }),
                );
            } else if let Some(named) = part["oneOf"].as_array() {
                variants.extend(named.iter().filter_map(|part| self.named(part)));
            } else {
                variants.push(self.variant(label, "", part));
            }
        }
        variants
    }

    /// A variant with a name; none for values without one, such as null.
    fn named(&self, part: &Value) -> Option<Variant> {
        let meaning = sentence(part);
        if let Some(name) = part["const"].as_str() {
            return Some(self.variant(name, &meaning, &Value::Null));
        }
        let properties = &part["properties"];
        let tag = TAGS.into_iter().find(|tag| properties[tag]["const"].is_string())?;
        let name = properties[tag]["const"].as_str()?;
        let keys = if tag == "type" { part } else { self.resolved(&properties["params"]) };
        Some(self.variant(name, &meaning, keys))
    }

    fn variant(&self, label: &str, meaning: &str, object: &Value) -> Variant {
        let none = Map::new();
        let properties = object["properties"].as_object().unwrap_or(&none);
        let mut variant = Variant {
            label: label.to_owned(),
            meaning: meaning.to_owned(),
            keys: Vec::new(),
            ignored: Vec::new(),
        };
        let is_required = |name: &str| {
            let required = object["required"].as_array();
            required.is_some_and(|required| required.iter().any(|key| key == name))
        };
        for (name, value) in properties.iter().filter(|(name, _)| *name != "type") {
            let key = self.key(name, value, is_required(name), label);
            let list =
                if sentence(value) == IGNORED { &mut variant.ignored } else { &mut variant.keys };
            list.push(key);
        }
        variant
    }

    fn key(&self, name: &str, value: &Value, is_required: bool, of: &str) -> Key {
        let Description { meaning, unit, default } = Description::read(value);
        let default = match &value["default"] {
            _ if is_required => "required".to_owned(),
            Value::Null | Value::Array(_) => default,
            _ if !default.is_empty() => default,
            known => format!("`{}`", known.to_string().trim_matches('"').trim_end_matches(".0")),
        };
        Key {
            name: name.to_owned(),
            values: self.values(value, unit),
            default,
            meaning: meaning + &self.names_inside(value),
            of: vec![of.to_owned()],
        }
    }

    /// Every key of every object.
    pub fn all_keys(&self) -> BTreeSet<String> {
        let mut keys = BTreeSet::new();
        collect(&self.0, &mut keys);
        keys
    }
}

fn collect(value: &Value, keys: &mut BTreeSet<String>) {
    if let Some(properties) = value["properties"].as_object() {
        keys.extend(properties.keys().filter(|key| *key != "type").cloned());
    }
    match value {
        Value::Object(parts) => parts.values().for_each(|part| collect(part, keys)),
        Value::Array(parts) => parts.iter().for_each(|part| collect(part, keys)),
        _ => {}
    }
}

/// Whether a key has no effect.
pub fn is_ignored(value: &Value) -> bool {
    sentence(value) == IGNORED
}

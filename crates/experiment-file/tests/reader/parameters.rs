//! Reader and schema agree on every parameter of every object, because both follow from one
//! declaration.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::generator::{Dice, experiment};
use super::validator::fits;
use super::{BASE, read};
use evolution::ALGORITHMS;
use experiment_file::{NeuronModel, json_schema};

/// Number of files to probe; each parameter is probed in the first file that has its object.
const N_FILES: u64 = 150;

/// One key of an object of a file.
struct Probe {
    /// The object's kind, and the key; each pair is probed once.
    parameter: (String, String),
    /// The object's place in the file, and in the words of problems.
    pointer: String,
    path: String,
    /// The schema of the key; `None` if the schema lacks it.
    schema: Option<Value>,
}

/// The keys of all objects of a file, both present and omitted ones.
struct Walk<'a> {
    root: &'a Value,
    file: &'a Value,
    probes: Vec<Probe>,
}

impl Walk<'_> {
    /// The alternative of the schema that the reader uses.
    fn chosen(&self, kind: &str, variants: &[Value], value: &Value) -> Option<usize> {
        match kind {
            "EnsembleConfig.params" => {
                let topology = &self.file["topology"];
                let named = [&topology["neuron_model"], &topology["neurons"]["model"]];
                let named = named.into_iter().find_map(Value::as_str).unwrap_or("rate_model");
                NeuronModel::ALL.iter().position(|model| model.spec().names.contains(&named))
            }
            "PopulationConfig.params" => {
                let named = &self.file["algorithm"]["name"];
                ALGORITHMS.iter().position(|algorithm| algorithm.name == *named)
            }
            _ => variants.iter().position(|one| fits(self.root, one, value)),
        }
    }

    fn visit(&mut self, schema: &Value, kind: &str, value: &Value, pointer: &str, path: &str) {
        if let Some(reference) = schema["$ref"].as_str() {
            let target = self.root.pointer(&reference[1..]).unwrap();
            let kind = reference.rsplit('/').next().unwrap();
            return self.visit(target, kind, value, pointer, path);
        }
        for variants in ["oneOf", "anyOf"].map(|key| schema[key].as_array()).into_iter().flatten() {
            if let Some(index) = self.chosen(kind, variants, value) {
                let fitting = &variants[index];
                let tag =
                    ["type", "name", "scheme"].map(|tag| &fitting["properties"][tag]["const"]);
                let tag = tag.into_iter().find_map(Value::as_str).unwrap_or_default();
                let title = fitting["title"].as_str().unwrap_or_default();
                let kind = format!("{kind}/{tag}{title}{}", if tag.is_empty() { index } else { 0 });
                self.visit(fitting, &kind, value, pointer, path);
            }
        }
        match (value, &schema["items"]) {
            (Value::Array(elements), items) if items.is_object() => {
                for (i, element) in elements.iter().enumerate() {
                    let (pointer, path) = (format!("{pointer}/{i}"), format!("{path}[{i}]"));
                    self.visit(items, &format!("{kind}[]"), element, &pointer, &path);
                }
            }
            (Value::Object(object), _) => {
                let inner = |key: &str| {
                    let dot = if path.is_empty() { "" } else { "." };
                    (format!("{pointer}/{key}"), format!("{path}{dot}{key}"))
                };
                let properties = schema["properties"].as_object();
                let none = [("unheard_of".to_owned(), Value::Null)];
                let unknown = none.iter().filter(|_| schema["additionalProperties"] == false);
                let known = properties.into_iter().flatten().chain(unknown.map(|(k, v)| (k, v)));
                for (key, schema) in known {
                    self.probes.push(Probe {
                        parameter: (kind.to_owned(), key.clone()),
                        pointer: pointer.to_owned(),
                        path: inner(key).1,
                        schema: Some(schema.clone()).filter(|schema| !schema.is_null()),
                    });
                }
                for (key, value) in object {
                    let own = properties.and_then(|properties| properties.get(key));
                    let (pointer, path) = inner(key);
                    let schema = own.unwrap_or(&schema["additionalProperties"]);
                    self.visit(schema, &format!("{kind}.{key}"), value, &pointer, &path);
                }
            }
            _ => {}
        }
    }
}

/// The file with another value of a key; `None` removes the key.
fn changed(file: &Value, probe: &Probe, value: Option<&Value>) -> Value {
    let mut file = file.clone();
    let object = file.pointer_mut(&probe.pointer).and_then(Value::as_object_mut).unwrap();
    match value {
        Some(value) => drop(object.insert(probe.parameter.1.clone(), value.clone())),
        None => drop(object.remove(&probe.parameter.1)),
    }
    file
}

/// Whether the reader refuses the value of the key itself, not a conflict with other values.
fn is_refused(file: &Value, path: &str) -> bool {
    let Err(error) = read(&file.to_string()) else { return false };
    let of_itself =
        ["must be ", "expected ", "unknown name", "a name must", "unknown key", "not sup"];
    error.problems.iter().any(|problem| {
        problem.path == path && of_itself.iter().any(|begin| problem.message.starts_with(begin))
    })
}

/// Values at and beyond the bounds that the schema states, and of all types.
fn candidates(schema: &Value) -> Vec<Value> {
    let mut values = vec![json!(true), json!(0.5), json!("unheard of"), json!({"unheard_of": 1})];
    for key in ["minimum", "maximum", "exclusiveMinimum"] {
        if let Some(bound) = schema[key].as_f64() {
            let step = if schema["type"] == "integer" { 1.0 } else { bound.abs().max(1.0) * 1e-6 };
            values.extend([bound - step, bound, bound + step].map(|value| json!(value)));
        }
    }
    values.extend(schema["default"].as_str().map(|name| json!(name)));
    values
}

/// Whether a schema is plain. Alternatives have their own names or types, and their inner values
/// are probed there.
fn is_plain(schema: &Value) -> bool {
    ["string", "number", "integer", "boolean"].iter().any(|kind| schema["type"] == *kind)
        && schema["pattern"].is_null()
        || schema["enum"].is_array() && schema["type"].is_null()
}

#[test]
fn the_reader_refuses_a_value_of_a_parameter_if_the_schema_does() {
    let root = json_schema(ALGORITHMS);
    let (mut seen, mut differ) = (BTreeSet::new(), Vec::new());
    let (mut n_refused, mut n_accepted) = (0, 0);
    for file in files() {
        for probe in probes(&root, &file) {
            // A population may contain the parameters of its algorithm directly, but a schema
            // cannot tell the algorithm. An object with a position determines the number of
            // components.
            let of_itself = probe.parameter.0 != "PopulationConfig"
                && probe.parameter.1 != "size"
                && probe.schema.as_ref().is_none_or(is_plain);
            if !of_itself || !seen.insert(probe.parameter.clone()) {
                continue;
            }
            let Some(schema) = &probe.schema else {
                let refused = is_refused(&changed(&file, &probe, Some(&json!(1))), &probe.path);
                assert!(refused, "{}", probe.path);
                continue;
            };
            for value in candidates(schema) {
                let fits = fits(&root, schema, &value);
                let refused = is_refused(&changed(&file, &probe, Some(&value)), &probe.path);
                if refused == fits {
                    differ.push(format!("{:?} {}: {value}", probe.parameter, probe.path));
                }
                *if refused { &mut n_refused } else { &mut n_accepted } += 1;
            }
        }
    }
    assert_eq!(differ, [""; 0]);
    assert!(seen.len() > 250, "{} parameters and unknown keys", seen.len());
    assert!(n_refused > 600 && n_accepted > 500, "{n_refused} refused, {n_accepted} accepted");
}

#[test]
fn a_default_of_the_schema_means_the_same_as_no_key() {
    let root = json_schema(ALGORITHMS);
    let mut seen = BTreeSet::new();
    // A platform has its own defaults.
    let is_plain = |file: &Value| !file.to_string().contains(r#""platform":"#);
    for file in files().filter(|file| file["semantics"] != "original" && is_plain(file)) {
        for probe in probes(&root, &file) {
            let default = probe.schema.as_ref().and_then(|schema| schema.get("default"));
            let Some(default) = default.filter(|_| !seen.contains(&probe.parameter)) else {
                continue;
            };
            let [without, with] =
                [None, Some(default)].map(|value| read(&changed(&file, &probe, value).to_string()));
            if let (Ok((without, _)), Ok((with, _))) = (without, with) {
                assert_eq!(without, with, "{:?} {}: {default}", probe.parameter, probe.path);
                seen.insert(probe.parameter);
            }
        }
    }
    assert!(seen.len() > 100, "{} defaults", seen.len());
}

fn files() -> impl Iterator<Item = Value> {
    let base = serde_json::from_str(BASE).unwrap();
    [base].into_iter().chain((0..N_FILES).map(|index| experiment(&mut Dice::new(index))))
}

fn probes(root: &Value, file: &Value) -> Vec<Probe> {
    let mut walk = Walk { root, file, probes: Vec::new() };
    walk.visit(root, "file", file, "", "");
    walk.probes
}

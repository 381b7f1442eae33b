//! Answers against their schemas, and the schemas against the files of them.

use std::{collections::BTreeSet, env, fs, path::Path};

use clap::{Command, CommandFactory as _};
use serde::Serialize;

use super::*;
use crate::{cli::Args, output_format::OutputFormat};

/// Commands that print nothing for programs.
const SILENT: [&str; 2] = ["help", "referee"];

/// Panics unless a value fits a schema.
fn expect_valid(schema: &Value, value: &Value) {
    let validator = jsonschema::draft202012::new(schema).expect("a JSON Schema");
    let mistakes: Vec<String> = validator
        .iter_errors(value)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(mistakes.is_empty(), "{mistakes:#?} in {value:#}");
}

/// Panics unless a value fits the schema of its type.
pub fn check<T: Serialize + JsonSchema>(answer: &T) {
    let value = serde_json::to_value(answer).expect("plain data with string keys serialises");
    expect_valid(&whole(&[part::<T>()], &[]), &value);
}

/// Panics unless everything that a command line printed fits the schema of its command.
pub fn check_printed(line: &str, format: OutputFormat, text: &str) {
    if format != OutputFormat::Json {
        return;
    }
    let command = line.split(' ').next().expect("a command line has words");
    let schema = schema_of(command).unwrap_or_else(|| panic!("`{command}` has no schema"));
    for value in serde_json::Deserializer::from_str(text).into_iter() {
        let value: Value = value.unwrap_or_else(|error| panic!("{command}: {error}: {text}"));
        expect_valid(&schema, &value);
    }
}

#[test]
fn every_command_has_a_schema_and_every_schema_a_command() {
    fn words(command: &Command) -> Vec<&str> {
        std::iter::once(command.get_name()).chain(command.get_all_aliases()).collect()
    }
    let mut definition = Args::command();
    definition.build();
    let commands = definition.get_subcommands().flat_map(words);
    let commands: BTreeSet<&str> = commands.filter(|name| !SILENT.contains(name)).collect();
    let expected: BTreeSet<&str> = commands.into_iter().chain(["error"]).collect();
    assert_eq!(names().collect::<BTreeSet<_>>(), expected);
    assert_eq!(names().count(), expected.len(), "a name appears twice");
}

#[test]
fn the_files_are_the_schemas() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas");
    let is_update = env::var("INSTA_UPDATE").is_ok_and(|how| how == "always");
    // The schema of experiment files has tests of its own.
    let other = OTHER_WORDS.map(|(word, _)| word).into_iter().chain([FILE]);
    let other: BTreeSet<&str> = other.collect();
    let mut files = BTreeSet::new();
    for name in names().filter(|name| !other.contains(name)) {
        let schema = schema_of(name).unwrap();
        jsonschema::meta::validate(&schema).unwrap_or_else(|error| panic!("{name}: {error}"));
        let text = format!("{schema:#}\n");
        let path = folder.join(format!("{name}.json"));
        if is_update {
            fs::write(&path, &text).unwrap();
        }
        let is_current = fs::read_to_string(&path).is_ok_and(|file| file == text);
        assert!(is_current, "{name}.json: INSTA_UPDATE=always cargo test -p swarmctl answers");
        files.insert(path);
    }
    let found = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    assert_eq!(found.collect::<BTreeSet<_>>(), files, "no other files");
}

#[test]
fn every_key_has_a_meaning() {
    fn objects<'a>(schema: &'a Value, found: &mut Vec<(&'a str, &'a Value)>) {
        match schema {
            Value::Object(keys) => {
                if let Some(properties) = keys.get("properties").and_then(Value::as_object) {
                    found.extend(properties.iter().map(|(key, value)| (&**key, value)));
                }
                keys.values().for_each(|value| objects(value, found));
            }
            Value::Array(parts) => parts.iter().for_each(|part| objects(part, found)),
            _ => {}
        }
    }
    for name in names().filter(|name| *name != FILE) {
        let schema = schema_of(name).unwrap();
        let mut keys = Vec::new();
        objects(&schema, &mut keys);
        for (key, value) in keys {
            // A type tells its meaning, a constant tells itself.
            let says = ["description", "$ref", "const"];
            let is_told = says.iter().any(|word| value.get(word).is_some());
            assert!(is_told, "{name}: {key} {value}");
        }
    }
}

#[test]
fn a_key_too_many_or_too_few_is_a_mistake() {
    let schema = schema_of("fork").unwrap();
    let is_valid = |value: &Value| jsonschema::is_valid(&schema, value);
    let good = json!({
        "experiment": 3, "state": "failed", "reason": "item 7", "digest": null, "champion": null,
    });
    assert!(is_valid(&good));
    let mut more = good.clone();
    more["champions"] = Value::Null;
    assert!(!is_valid(&more));
    let mut fewer = good.clone();
    fewer.as_object_mut().unwrap().remove("digest");
    assert!(!is_valid(&fewer));
    let mut other = good;
    other["state"] = "done".into();
    assert!(!is_valid(&other));
}

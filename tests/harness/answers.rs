//! Answers of `swarmctl --output json` against the schemas that it prints.

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    process::Command,
    sync::{Arc, Mutex},
};

use jsonschema::Validator;
use serde_json::Value;

use crate::binary;

/// The answers of one command.
#[derive(Debug, Clone)]
pub(crate) struct Answers {
    /// The command, or `error`.
    command: String,
}

impl Answers {
    /// Errors, which any command may print.
    pub(crate) fn of_errors() -> Self {
        Self { command: "error".to_owned() }
    }

    /// The answers of a command line: the first word that is neither an option nor an address or
    /// a path is the command. None if the line asks for another format than JSON.
    pub(crate) fn of_line<A: AsRef<OsStr>>(args: &[A]) -> Option<Self> {
        let words: Vec<&str> = args.iter().filter_map(|word| word.as_ref().to_str()).collect();
        if words.iter().any(|word| ["--output", "-o"].contains(word)) {
            return None;
        }
        let is_name = |word: &&str| {
            word.starts_with(|c: char| c.is_ascii_lowercase())
                && word.chars().all(|c| c.is_ascii_lowercase() || c == '-')
        };
        let command = words.into_iter().find(is_name).expect("a command line names a command");
        Some(Self { command: command.to_owned() })
    }

    /// Panics unless all values of a text are answers.
    pub(crate) fn check_text(&self, text: &str) {
        for value in serde_json::Deserializer::from_str(text).into_iter() {
            self.check(&value.unwrap_or_else(|error| panic!("{}: {error}: {text}", self.command)));
        }
    }

    /// Panics unless a value is an answer.
    pub(crate) fn check(&self, value: &Value) {
        let mistakes: Vec<String> = schema(&self.command)
            .iter_errors(value)
            .map(|error| format!("{}: {error}", error.instance_path()))
            .collect();
        assert!(mistakes.is_empty(), "{}: {mistakes:#?} in {value:#}", self.command);
    }
}

/// The schema of a command's answers, which is read once.
fn schema(command: &str) -> Arc<Validator> {
    static READ: Mutex<BTreeMap<String, Arc<Validator>>> = Mutex::new(BTreeMap::new());
    let mut read = READ.lock().expect("a test before this one has printed what is wrong");
    let schema = read.entry(command.to_owned()).or_insert_with(|| {
        let mut swarmctl = Command::new(binary("swarmctl"));
        let printed = swarmctl.args(["schema", "--of", command]).output();
        let schema = serde_json::from_slice(&printed.expect("the program starts").stdout);
        let schema = schema.unwrap_or_else(|error| panic!("`{command}` has no schema: {error}"));
        Arc::new(jsonschema::draft202012::new(&schema).expect("a JSON Schema"))
    });
    Arc::clone(schema)
}

//! `swarmctl schema`: the JSON Schema of experiment files, or one key of it.

use std::ffi::OsStr;

use clap::{Args, builder::PossibleValuesParser};
use clap_complete::{ArgValueCompleter, CompletionCandidate};
use evolution::ALGORITHMS;
use experiment_file::{Alternative, KeyFacts, explain_key, json_schema, plain};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::answers;
use crate::{
    error::{Code, Error},
    examples::EXAMPLES,
    progress::Progress,
};

/// Longest example of a value, characters.
const EXAMPLE_LEN_MAX: usize = 100;

/// Print the JSON Schema of experiment files or of an answer, or explain one key.
///
/// Editors use the schema to complete and check experiment files. --key explains one key: its
/// meaning, range, default and an example, and the keys below it. --of prints the schema of what a
/// command prints with --output json.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct SchemaArgs {
    /// Explain this key, such as algorithm.population_size. NAME stands for a name of your choice:
    /// world.objects.NAME.num_instances.
    #[arg(long, value_name = "KEY", add = ArgValueCompleter::new(keys))]
    key: Option<String>,
    /// Print the JSON Schema of what this command prints with --output json; `error`: of the
    /// errors.
    #[arg(
        long,
        value_name = "COMMAND",
        conflicts_with = "key",
        value_parser = PossibleValuesParser::new(answers::names()),
        hide_possible_values = true
    )]
    of: Option<String>,
}

const HELP: &str = "\
Examples:
  swarmctl schema > experiment.schema.json
  swarmctl schema --key algorithm
  swarmctl schema --key world.objects.NAME.sensors --output json
  swarmctl schema --of watch > watch.schema.json
  swarmctl schema --of error";

/// One key of experiment files.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Explained {
    #[serde(flatten)]
    facts: KeyFacts,
    /// A value of one of the examples; null if they do not have the key, or its value is long.
    example: Option<Value>,
}

/// Prints the schema, or what it says about a key.
pub fn schema(args: &SchemaArgs, progress: &mut Progress) -> Result<(), Error> {
    if let Some(name) = &args.of {
        let schema = answers::schema_of(name).expect("the parser takes no other name");
        return progress.print_document(&schema);
    }
    let schema = json_schema(ALGORITHMS);
    let Some(key) = &args.key else { return progress.print_document(&schema) };
    let facts = explain_key(&schema, key)
        .map_err(|error| Error::at(Code::UnknownKey, key, error.to_string()))?;
    let explained = Explained { example: example(&facts.key), facts };
    match progress.is_json() {
        true => progress.print_document(&explained),
        false => progress.print(&explained.to_text()),
    }
}

/// The keys that begin with a text.
fn keys(typed: &OsStr) -> Vec<CompletionCandidate> {
    let typed = typed.to_string_lossy();
    let (above, prefix) = match typed.rsplit_once('.') {
        Some((above, _)) => (above, format!("{above}.")),
        None => ("", String::new()),
    };
    let Ok(facts) = explain_key(&json_schema(ALGORITHMS), above) else { return Vec::new() };
    let known = facts.below.into_iter().map(|(name, about)| (format!("{prefix}{name}"), about));
    let fitting = known.filter(|(key, _)| key.starts_with(&*typed));
    fitting.map(|(key, about)| CompletionCandidate::new(key).help(Some(about.into()))).collect()
}

/// The value of the first example that has the key.
fn example(key: &str) -> Option<Value> {
    let path: Vec<&str> = key.split('.').collect();
    let values = EXAMPLES.iter().filter_map(|example| {
        let file: Value = serde_json::from_str(&plain(example.config)).ok()?;
        value_at(&file, &path).cloned()
    });
    let mut short = values.filter(|value| value.to_string().len() <= EXAMPLE_LEN_MAX);
    short.next()
}

/// The value at a path; a name that the value lacks stands for any of its names.
fn value_at<'a>(value: &'a Value, path: &[&str]) -> Option<&'a Value> {
    let Some((name, rest)) = path.split_first() else { return Some(value) };
    match value {
        Value::Object(keys) if *name == "NAME" => {
            keys.values().find_map(|value| value_at(value, rest))
        }
        Value::Object(keys) => value_at(keys.get(*name)?, rest),
        Value::Array(elements) => elements.iter().find_map(|element| value_at(element, path)),
        _ => None,
    }
}

impl Explained {
    fn to_text(&self) -> String {
        let KeyFacts { key, required, facts, others, below, required_below } = &self.facts;
        let mut lines =
            vec![if key.is_empty() { "an experiment file".into() } else { key.clone() }];
        for alternative in std::iter::once(facts).chain(others) {
            lines.extend(alternative_text(alternative, *required));
        }
        if let Some(example) = &self.example {
            lines.push(format!("  example: {example}"));
        }
        if !below.is_empty() {
            lines.push("keys below it:".into());
        }
        let width = below.keys().map(String::len).max().unwrap_or_default();
        lines.extend(below.iter().map(|(name, about)| {
            let is_required = required_below.contains(name);
            let about = if is_required { format!("required: {about}") } else { about.clone() };
            format!("  {name:<width$}  {about}").trim_end().to_owned()
        }));
        lines.join("\n")
    }
}

fn alternative_text(alternative: &Alternative, is_required: bool) -> Vec<String> {
    let Alternative { of, description, types, values, default, .. } = alternative;
    let mut lines = Vec::new();
    if !of.is_empty() {
        lines.push(format!("  of {}:", of.join(", ")));
    }
    if !description.is_empty() {
        lines.push(format!("  {description}"));
    }
    let range = range(alternative);
    if !types.is_empty() {
        let types = types.join(" or ");
        lines.push(format!("  values: {types}{}{range}", if range.is_empty() { "" } else { ", " }));
    }
    lines.extend(values.iter().map(|allowed| {
        let meaning = allowed.meaning.split_whitespace().collect::<Vec<_>>().join(" ");
        format!("    {}  {meaning}", allowed.value).trim_end().to_owned()
    }));
    match default {
        Some(default) => lines.push(format!("  default: {default}")),
        None if is_required => lines.push("  required".into()),
        None => {}
    }
    lines
}

/// The range of numbers or lengths in words; empty if there is none.
fn range(alternative: &Alternative) -> String {
    let Alternative { minimum, exclusive_minimum, maximum, min_items, max_items, .. } = alternative;
    let mut parts = Vec::new();
    parts.extend(exclusive_minimum.iter().map(|bound| format!("above {bound}")));
    parts.extend(minimum.iter().map(|bound| format!("{bound} or more")));
    parts.extend(maximum.iter().map(|bound| format!("{bound} or less")));
    if min_items.is_some() && min_items == max_items {
        parts.extend(min_items.map(|n| format!("{n} elements")));
    } else {
        parts.extend(min_items.map(|n| format!("{n} elements or more")));
        parts.extend(max_items.map(|n| format!("{n} elements or fewer")));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{output_format::OutputFormat, progress::tests::Captured};

    fn print(key: &str, format: OutputFormat) -> Result<String, Error> {
        let captured = Captured::default();
        let args = SchemaArgs { key: Some(key.to_owned()), of: None };
        schema(&args, &mut captured.progress(format))?;
        Ok(captured.lines().join("\n"))
    }

    #[test]
    fn a_key_has_an_example_of_a_shipped_file() {
        let text = print("world.objects.swarm.num_instances", OutputFormat::Json).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(found["example"], Value::Null, "no example names its robots so");
        let text = print("world.objects.NAME.num_instances", OutputFormat::Json).unwrap();
        let found: Value = serde_json::from_str(&text).unwrap();
        assert!(found["example"].is_u64(), "{found}");
        assert_eq!(found["key"], "world.objects.NAME.num_instances");
    }

    #[test]
    fn a_key_for_people_is_a_few_lines() {
        let text = print("world.width", OutputFormat::Table).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "world.width");
        assert!(lines.iter().any(|line| line.starts_with("  default: 1000")), "{text}");
        let text = print("", OutputFormat::Table).unwrap();
        assert!(text.contains("\n  world            required: The arena"), "{text}");
    }

    #[test]
    fn keys_are_completed_level_by_level() {
        let found = |typed: &str| -> Vec<String> {
            let candidates = keys(OsStr::new(typed));
            let values = candidates.iter().map(|candidate| candidate.get_value().to_string_lossy());
            values.map(|value| value.into_owned()).collect()
        };
        assert_eq!(found("wor"), ["world"]);
        assert_eq!(found("world.wi"), ["world.width"]);
        assert!(found("nothing.wi").is_empty());
    }

    #[test]
    fn an_unknown_key_leads_to_the_known_one() {
        let error = print("algorithm.population_sise", OutputFormat::Json).unwrap_err();
        assert_eq!(error.code().name(), "unknown_key");
        assert_eq!(error.place().as_deref(), Some("algorithm.population_sise"));
        assert!(error.to_string().ends_with("did you mean `population_size`?"), "{error}");
    }
}

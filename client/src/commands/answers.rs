//! The JSON Schemas of what commands print with `--output json`. `client/schemas` has their files.

use evolution::ALGORITHMS;
use experiment_file::json_schema;
use schemars::{
    JsonSchema, Schema, SchemaGenerator,
    generate::SchemaSettings,
    transform::{Transform, transform_subschemas},
};
use serde_json::{Value, json};

use super::{
    bench, compare, completions, doctor, evaluate, examples, explain, export, export_controller,
    fleet, front, history, lineage, man, new, plot, repertoire, replay, schema, simulate, validate,
    verify, web, workers,
};
use crate::{
    consent::Planned,
    error::Answer,
    json::{
        ChampionDocument, EndLine, ExperimentDocument, GenerationLine, IndividualDocument, LogLine,
        OneOrMore, PopulationDocument,
    },
};

/// The dialect of all schemas, which is also the schema of a schema.
const DIALECT: &str = "https://json-schema.org/draft/2020-12/schema";

/// How an answer is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// One value.
    Document,
    /// Values, one on each line.
    Lines,
    /// One value; or lines, if the command follows experiments to their end.
    Either,
    /// The last line of standard error, after remarks for people.
    LastLine,
}

impl Form {
    fn about(self) -> &'static str {
        match self {
            Self::Document => "One JSON document.",
            Self::Lines => "JSON Lines: each line is one of these.",
            Self::Either => {
                "One JSON document; or JSON Lines, if the command follows experiments to their end."
            }
            Self::LastLine => "The last line of standard error.",
        }
    }
}

/// Adds the schema of a type to those of a generator.
type Part = fn(&mut SchemaGenerator) -> Schema;

/// What commands print.
struct Printed {
    commands: &'static [&'static str],
    form: Form,
    /// The types of its answers: every printed value has one of them.
    parts: &'static [Part],
}

const fn part<T: JsonSchema>() -> Part {
    SchemaGenerator::subschema_for::<T>
}

type Experiments<'a> = OneOrMore<ExperimentDocument<'a>>;
type Explanations<'a> = OneOrMore<explain::Explanation<'a>>;

/// The answers of all commands but [`FILE`].
const PRINTED: &[Printed] = &[
    Printed { commands: &["error"], form: Form::LastLine, parts: &[part::<Answer>()] },
    Printed {
        commands: &["archive", "cancel", "label", "pause", "priority"],
        form: Form::Document,
        parts: &[part::<Experiments<'_>>()],
    },
    Printed {
        commands: &["delete", "prune"],
        form: Form::Document,
        parts: &[part::<Experiments<'_>>(), part::<Planned<'_>>()],
    },
    Printed {
        commands: &["resume", "submit"],
        form: Form::Either,
        parts: &[part::<Experiments<'_>>(), part::<GenerationLine<'_>>(), part::<EndLine<'_>>()],
    },
    Printed {
        commands: &["fork"],
        form: Form::Either,
        parts: &[
            part::<ExperimentDocument<'_>>(),
            part::<GenerationLine<'_>>(),
            part::<EndLine<'_>>(),
        ],
    },
    Printed {
        commands: &["run"],
        form: Form::Lines,
        parts: &[part::<GenerationLine<'_>>(), part::<EndLine<'_>>()],
    },
    Printed {
        commands: &["watch"],
        form: Form::Lines,
        parts: &[
            part::<GenerationLine<'_>>(),
            part::<EndLine<'_>>(),
            part::<LogLine<'_>>(),
            part::<ExperimentDocument<'_>>(),
        ],
    },
    Printed { commands: &["fleet"], form: Form::Lines, parts: &[part::<fleet::Look<'_>>()] },
    Printed {
        commands: &["web"],
        form: Form::Lines,
        parts: &[part::<web::Served>(), part::<web::Written>()],
    },
    document(&["backup"], &[part::<doctor::InspectionDocument<'_>>()]),
    document(&["bench"], &[part::<bench::Report<'_>>()]),
    document(
        &["compare"],
        &[part::<compare::report::Report>(), part::<compare::realities::Ranking>()],
    ),
    document(&["completions"], &[part::<completions::Completions<'_>>()]),
    document(
        &["doctor"],
        &[part::<doctor::InspectionDocument<'_>>(), part::<doctor::RecoveryDocument<'_>>()],
    ),
    document(&["evaluate"], &[part::<evaluate::summary::Summary>()]),
    document(&["examples"], &[part::<Vec<examples::Listed>>()]),
    document(&["explain"], &[part::<Explanations<'_>>(), part::<explain::fleet::Fleet<'_>>()]),
    document(&["export"], &[part::<export::Written>()]),
    document(&["export-controller"], &[part::<export_controller::Written<'_>>()]),
    document(&["front"], &[part::<front::Document>(), part::<front::Drawn>()]),
    document(
        &["history"],
        &[part::<Vec<GenerationLine<'_>>>(), part::<Vec<history::dynamics::Record>>()],
    ),
    document(&["import"], &[part::<ExperimentDocument<'_>>()]),
    document(
        &["individual"],
        &[
            part::<ChampionDocument<'_>>(),
            part::<IndividualDocument<'_>>(),
            part::<PopulationDocument<'_>>(),
        ],
    ),
    document(&["lineage"], &[part::<lineage::LineageDocument<'_>>()]),
    document(&["list"], &[part::<Vec<ExperimentDocument<'_>>>()]),
    document(&["man"], &[part::<man::Written>()]),
    document(&["new"], &[part::<new::Written<'_>>()]),
    document(&["plot"], &[part::<plot::Plotted>(), part::<plot::PlottedSteps<'_>>()]),
    document(&["repertoire"], &[part::<repertoire::Document>(), part::<repertoire::Mapped>()]),
    document(&["replay"], &[part::<replay::Written>()]),
    document(
        &["schema"],
        &[part::<schema::Explained>(), |_| schemars::json_schema!({"$ref": DIALECT})],
    ),
    document(&["simulate"], &[part::<simulate::SimulationReport<'_>>()]),
    document(&["validate"], &[part::<Vec<validate::Report>>()]),
    document(&["verify"], &[part::<verify::Report>()]),
    document(&["workers"], &[part::<Vec<workers::Record<'_>>>()]),
];

const fn document(commands: &'static [&'static str], parts: &'static [Part]) -> Printed {
    Printed { commands, form: Form::Document, parts }
}

/// The command that prints an experiment file, whose schema `swarmctl schema` prints.
const FILE: &str = "get";

/// Other words for commands, and commands of earlier releases.
const OTHER_WORDS: [(&str, &str); 6] = [
    ("champion", "individual"),
    ("extend", "resume"),
    ("logs", "watch"),
    ("ls", "list"),
    ("retry", "resume"),
    ("wait", "watch"),
];

/// The names for which there is a schema: commands, and `error`.
pub fn names() -> impl Iterator<Item = &'static str> {
    let printed = PRINTED.iter().flat_map(|printed| printed.commands).copied();
    printed.chain([FILE]).chain(OTHER_WORDS.iter().map(|(word, _)| *word))
}

/// The schema of what a command prints.
pub fn schema_of(name: &str) -> Option<Value> {
    let other = OTHER_WORDS.iter().find(|(word, _)| *word == name);
    let name = other.map_or(name, |(_, command)| command);
    if name == FILE {
        return Some(json_schema(ALGORITHMS));
    }
    let Printed { form, parts, .. } =
        PRINTED.iter().find(|printed| printed.commands.contains(&name))?;
    let title = match form {
        Form::LastLine => "Errors of swarmctl --output json".to_owned(),
        _ => format!("swarmctl {name} --output json"),
    };
    Some(whole(parts, &[("title", &title), ("description", form.about())]))
}

/// The schema of values that are each one of some parts.
fn whole(parts: &[Part], head: &[(&str, &str)]) -> Value {
    let mut generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
    let mut whole = Schema::default();
    whole.insert("$schema".into(), json!(DIALECT));
    for (key, text) in head {
        whole.insert((*key).into(), json!(text));
    }
    let parts: Vec<Value> = parts.iter().map(|part| part(&mut generator).to_value()).collect();
    match &parts[..] {
        [Value::Object(one)] => one.iter().for_each(|(key, value)| {
            whole.insert(key.clone(), value.clone());
        }),
        _ => drop(whole.insert("anyOf".into(), Value::Array(parts))),
    }
    let definitions = generator.take_definitions(true);
    if !definitions.is_empty() {
        whole.insert("$defs".into(), Value::Object(definitions));
    }
    Exact.transform(&mut whole);
    whole.to_value()
}

/// Forbids keys that a schema does not name, and writes each description on one line.
struct Exact;

impl Transform for Exact {
    fn transform(&mut self, schema: &mut Schema) {
        close(schema, true);
    }
}

/// The keywords whose values are parts of one value.
const PARTS: [&str; 3] = ["oneOf", "anyOf", "allOf"];

/// `is_whole`: whether the schema describes all keys of an object, or is a part of another schema
/// that does.
fn close(schema: &mut Schema, is_whole: bool) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace('\n', " ");
    }
    let has_parts = PARTS.iter().any(|key| schema.get(*key).is_some());
    let has_keys = schema.get("properties").is_some();
    if is_whole && has_keys && schema.get("additionalProperties").is_none() {
        let key = if has_parts { "unevaluatedProperties" } else { "additionalProperties" };
        schema.insert(key.into(), json!(false));
    }
    if is_whole && !(has_parts && has_keys) {
        return transform_subschemas(&mut |part: &mut Schema| close(part, true), schema);
    }
    for key in PARTS {
        let parts = schema.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten();
        parts.filter_map(|part| part.try_into().ok()).for_each(|part| close(part, false));
    }
    let keys = schema.get_mut("properties").and_then(Value::as_object_mut);
    let values = keys.into_iter().flat_map(|keys| keys.values_mut());
    values.filter_map(|value| value.try_into().ok()).for_each(|value| close(value, true));
}

#[cfg(test)]
pub mod tests;

//! An error as one JSON object on standard error, which programs get with `--output json`.

use std::{ffi::OsString, path::Path};

use clap::error::{ContextKind, ContextValue};
use schemars::JsonSchema;
use serde::Serialize;

use super::{Code, Error};

/// Why a command did not succeed: the last line of standard error.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Answer {
    error: Failure,
}

/// What is wrong, where, and what to do.
#[derive(Debug, Serialize, JsonSchema)]
struct Failure {
    code: Code,
    /// A file, with `:LINE` if the line is known; an option; the number, name or address of an
    /// experiment or a genotype; or an address of the network. Null if the command as a whole is
    /// concerned.
    r#where: Option<String>,
    /// What people read.
    message: String,
    /// The next step.
    next: String,
    /// Every mistake of an experiment file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    mistakes: Vec<Mistake>,
}

/// A mistake of an experiment file.
#[derive(Debug, Serialize, JsonSchema)]
struct Mistake {
    /// The file, with `:LINE` if the line is known.
    r#where: String,
    /// The place in the file, such as `algorithm.population_size`.
    key: Option<String>,
    /// The mistake, and the values that are allowed.
    message: String,
}

impl From<&Error> for Answer {
    fn from(error: &Error) -> Self {
        let code = error.code();
        let report = error.report();
        Self {
            error: Failure {
                code,
                r#where: error.place(),
                message: report.strip_prefix("error: ").unwrap_or(&report).to_owned(),
                next: code.next().to_owned(),
                mistakes: mistakes(error),
            },
        }
    }
}

fn mistakes(error: &Error) -> Vec<Mistake> {
    let Error::Config { code: Code::InvalidExperiment, file, problems } = error else {
        return Vec::new();
    };
    let mistake = |problem: &experiment_file::Problem| Mistake {
        r#where: line_of(file, problem.line),
        key: Some(problem.path.clone()).filter(|path| !path.is_empty()),
        message: problem.message.clone(),
    };
    problems.iter().map(mistake).collect()
}

/// "a.json:3", or "a.json" if the line is unknown.
pub fn line_of(file: &Path, line: Option<usize>) -> String {
    match line {
        Some(line) => format!("{}:{line}", file.display()),
        None => file.display().to_string(),
    }
}

impl Answer {
    /// The answer to a command line that cannot be read.
    pub fn to_usage(error: &clap::Error) -> Self {
        let text = error.render().to_string();
        let mut message = Vec::new();
        let mut steps = Vec::new();
        let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
        for line in lines.filter(|line| !line.starts_with("For more information")) {
            if let Some(tip) = line.strip_prefix("tip: ") {
                steps.push(tip.to_owned());
            } else if let Some(usage) = line.strip_prefix("Usage: ") {
                steps.push(format!("usage: {usage}"));
            } else if steps.is_empty() {
                message.push(line.strip_prefix("error: ").unwrap_or(line));
            }
        }
        let place = [ContextKind::InvalidArg, ContextKind::InvalidSubcommand]
            .into_iter()
            .find_map(|kind| error.get(kind))
            .map(|value| match value {
                ContextValue::Strings(values) => values.join(", "),
                value => value.to_string(),
            });
        let code = Code::BadArgument;
        Self {
            error: Failure {
                code,
                r#where: place,
                message: message.join(" "),
                next: if steps.is_empty() { code.next().to_owned() } else { steps.join("; ") },
                mistakes: Vec::new(),
            },
        }
    }
}

/// Whether a command line, which may be invalid, asks for JSON.
pub fn wants_json(words: impl IntoIterator<Item = OsString>) -> bool {
    let mut words = words.into_iter().take_while(|word| word != "--");
    while let Some(word) = words.next() {
        let word = word.to_string_lossy().into_owned();
        let value = match &*word {
            "--output" | "--format" | "-o" => {
                words.next().map(|word| word.to_string_lossy().into())
            }
            _ => ["--output=", "--format=", "-o=", "-o"]
                .iter()
                .find_map(|option| word.strip_prefix(option))
                .map(str::to_owned),
        };
        if value.as_deref() == Some("json") {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use experiment_file::Problem;
    use serde_json::{Value, json};

    use super::*;
    use crate::{help, synonyms::with_suggestions};

    fn to_usage(line: &str) -> Value {
        let error = help::definition_for_tests().try_get_matches_from(line.split(' '));
        let answer = Answer::to_usage(&with_suggestions(error.unwrap_err()));
        serde_json::to_value(answer).unwrap()["error"].take()
    }

    #[test]
    fn every_mistake_of_a_file_has_its_line_and_its_key() {
        let problem = |line, path: &str, message: &str| Problem {
            path: path.into(),
            line,
            message: message.into(),
        };
        let problems =
            vec![problem(Some(3), "world.width", "must be 1 or more"), problem(None, "", "empty")];
        let code = Code::InvalidExperiment;
        let error = Error::Config { code, file: "a.json".into(), problems };
        let answer = serde_json::to_value(Answer::from(&error)).unwrap();
        assert_eq!(answer["error"]["code"], "invalid_experiment");
        assert_eq!(answer["error"]["where"], "a.json");
        let message = "a.json: line 3: world.width: must be 1 or more\na.json: empty";
        assert_eq!(answer["error"]["message"], message);
        let mistakes = json!([
            {"where": "a.json:3", "key": "world.width", "message": "must be 1 or more"},
            {"where": "a.json", "key": null, "message": "empty"},
        ]);
        assert_eq!(answer["error"]["mistakes"], mistakes);
    }

    #[test]
    fn a_refusal_keeps_its_code_and_gets_a_place_once() {
        let place_and_code = |error: &Error| (error.place(), error.code());
        for (error, code) in [
            (Error::NotFound("no experiment 9".into()), Code::NotFound),
            (Error::WrongState("it has ended".into()), Code::WrongState),
            (Error::Input("no such label".into()), Code::BadInput),
        ] {
            let message = error.to_string();
            let error = error.about(9).about("another");
            assert_eq!(place_and_code(&error), (Some("9".into()), code));
            assert_eq!(error.to_string(), message);
        }
        let error = Error::option("--judged", "300: the trials are 0 to 199");
        assert_eq!(place_and_code(&error), (Some("--judged".into()), Code::BadArgument));
        assert_eq!(error.to_string(), "--judged 300: the trials are 0 to 199");
    }

    #[test]
    fn usage_errors_name_the_argument_and_the_tip() {
        let error = to_usage("swarmctl list --output jsn");
        assert_eq!(error["code"], "bad_argument");
        assert_eq!(error["where"], "--output <FORMAT>");
        let message = error["message"].as_str().unwrap();
        assert!(message.starts_with("invalid value 'jsn'") && message.contains("csv"), "{message}");
        assert_eq!(error["next"], "a similar value exists: 'json'");

        let error = to_usage("swarmctl stop 3");
        assert_eq!(error["where"], "stop");
        assert_eq!(error["message"], "unrecognized subcommand 'stop'");
        assert!(error["next"].as_str().unwrap().starts_with("`cancel` ends an experiment"));

        let error = to_usage("swarmctl simulate");
        assert!(error["next"].as_str().unwrap().starts_with("usage: swarmctl simulate"), "{error}");
    }

    #[test]
    fn json_is_recognised_on_command_lines_that_cannot_be_read() {
        let wants = |line: &str| wants_json(line.split(' ').map(OsString::from));
        for line in ["x --output json", "x -ojson --nonsense", "x --format=json", "x -o json"] {
            assert!(wants(line), "{line}");
        }
        for line in ["x --output table", "x json", "x -- --output json", "x -o"] {
            assert!(!wants(line), "{line}");
        }
    }
}

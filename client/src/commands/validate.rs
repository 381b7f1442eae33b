//! `swarmctl validate`: checks experiment files, without a coordinator.

use std::path::{Path, PathBuf};

use clap::Args;
use experiment_file::{Problem, Seed};
use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    error::{Code, Error},
    experiment_file::{Compiled, ExperimentFile, Overrides},
    progress::Progress,
};

/// Check experiment files, without a coordinator.
///
/// Prints one line per valid file, its warnings, and every problem of every invalid one. A
/// warning concerns a value that is allowed but rarely intended, such as degrees instead of
/// radians.
#[derive(Debug, Args)]
pub struct ValidateArgs {
    /// The experiment files.
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Also fail (exit code 2) if a file has warnings.
    #[arg(long)]
    pub strict: bool,
}

/// Checks all files and reports on each; fails if one is invalid.
pub fn validate(args: &ValidateArgs, progress: &mut Progress) -> Result<(), Error> {
    let ValidateArgs { files, strict } = args;
    let mut reports = Vec::new();
    for file in files {
        let report = Report::of_file(file)?;
        for problem in &report.problems {
            progress.remark(&format!("{}: {problem}", report.file));
        }
        for warning in &report.warnings {
            progress.remark(&format!("warning: {}: {warning}", report.file));
        }
        if let (false, Some(summary)) = (progress.is_json(), &report.summary) {
            progress.print(&format!("{}: ok: {summary}", report.file))?;
        }
        reports.push(report);
    }
    if progress.is_json() {
        progress.print_document(&reports)?;
    }
    let n_bad = reports.iter().filter(|report| !report.ok).count();
    let n_doubtful = reports.iter().filter(|report| !report.warnings.is_empty()).count();
    match (n_bad, n_doubtful) {
        (0, 0) => Ok(()),
        (0, _) if !strict => Ok(()),
        (0, n) => {
            let mut doubtful = reports.iter().filter(|report| !report.warnings.is_empty());
            let first = doubtful.next().map_or("", |report| &report.file);
            let n_all = files.len();
            let message =
                format!("experiment files with warnings: {n} of {n_all}, and --strict allows none");
            Err(Error::at(Code::BadInput, first, message))
        }
        (n, _) => {
            let bad = reports.iter().find(|report| !report.ok).map_or("", |report| &report.file);
            let message = format!("experiment files with problems: {n} of {}", files.len());
            Err(Error::at(Code::InvalidExperiment, bad, message))
        }
    }
}

/// The problems and warnings of a file, and its summary if it is valid.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Validation")]
pub struct Report {
    /// Path of the file.
    file: String,
    /// Whether the file is valid.
    ok: bool,
    /// Every mistake.
    #[serde(serialize_with = "problems")]
    #[schemars(with = "Vec<Located<'_>>")]
    problems: Vec<Problem>,
    /// Values that are allowed but rarely intended.
    #[serde(serialize_with = "problems")]
    #[schemars(with = "Vec<Located<'_>>")]
    warnings: Vec<Problem>,
    #[serde(flatten)]
    summary: Option<Summary>,
}

/// The main values of a valid file; absent if it has mistakes.
#[derive(Debug, Serialize, JsonSchema)]
struct Summary {
    /// Name of the experiment.
    name: String,
    seed: Seed,
    /// Name of the algorithm.
    algorithm: String,
    /// Number of individuals of a generation.
    population_size: u32,
    /// Number of generations.
    generations: u64,
    /// Number of trials of an individual.
    trials: u32,
    /// Number of steps of a trial.
    steps: u32,
    /// Number of robots of all objects.
    robots: u32,
    /// Number of genes of an individual.
    genotype_len: usize,
}

/// A mistake or a warning.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Problem")]
struct Located<'a> {
    /// The place in the file, such as algorithm.population_size; empty for the file as a whole.
    path: &'a str,
    /// The line of the file, from 1; null if it is unknown.
    line: Option<usize>,
    /// What is wrong, and what is allowed.
    message: &'a str,
}

impl Report {
    fn of_file(path: &Path) -> Result<Self, Error> {
        let checked = ExperimentFile::read(path).and_then(|file| {
            file.check(&Overrides::default()).map_err(|error| file.invalid(&error))
        });
        let file = path.to_string_lossy().into_owned();
        match checked {
            Ok(compiled) => {
                let summary = Some(Summary::from_compiled(&compiled));
                Ok(Self { file, ok: true, problems: vec![], warnings: compiled.warnings, summary })
            }
            Err(Error::Config { problems, .. }) => {
                Ok(Self { file, ok: false, problems, warnings: vec![], summary: None })
            }
            Err(error) => Err(error),
        }
    }
}

impl Summary {
    fn from_compiled(compiled: &Compiled) -> Self {
        let Compiled { config, experiment, .. } = compiled;
        Self {
            name: config.name.clone(),
            seed: Seed(config.seed),
            algorithm: config.algorithm.name.clone(),
            population_size: config.algorithm.population_size,
            generations: config.algorithm.generations,
            trials: config.algorithm.num_evaluations,
            steps: config.algorithm.evaluation_steps,
            robots: config.robots().map(|(_, robots)| robots.num_instances).sum(),
            genotype_len: experiment.genotype_len(),
        }
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}, {}, {} robots, {} genes, {} generations",
            self.name, self.algorithm, self.robots, self.genotype_len, self.generations,
        )
    }
}

/// Problems as JSON.
fn problems<S: serde::Serializer>(problems: &[Problem], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(problems.iter().map(|Problem { path, line, message }| Located {
        path,
        line: *line,
        message,
    }))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use serde_json::{Value, json};

    use super::*;
    use crate::{
        experiment_file::tests::quickstart, output_format::OutputFormat, progress::tests::Captured,
    };

    fn files() -> (tempfile::TempDir, [PathBuf; 3]) {
        let dir = tempfile::tempdir().unwrap();
        let bad = dir.path().join("bad.json");
        let text = fs::read_to_string(quickstart()).unwrap();
        let text = text.replace("\"dt\"", "\"ct\"").replace("\"steps\"", "\"stops\"");
        fs::write(&bad, text.replace("\"generations\": 60", "\"generations\": -1")).unwrap();
        let missing = dir.path().join("missing.json");
        (dir, [quickstart(), bad, missing])
    }

    fn args(files: &[PathBuf]) -> ValidateArgs {
        ValidateArgs { files: files.to_vec(), strict: false }
    }

    #[test]
    fn warnings_are_shown_and_fail_a_strict_check() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("degrees.json");
        let text = fs::read_to_string(quickstart()).unwrap();
        fs::write(&path, text.replace("6.283185307179586", "360")).unwrap();
        let captured = Captured::default();
        let mut given = args(&[quickstart(), path]);
        validate(&given, &mut captured.progress(OutputFormat::Json)).unwrap();
        let reports: Value = serde_json::from_str(&captured.lines().join("\n")).unwrap();
        assert_eq!((&reports[1]["ok"], &reports[0]["warnings"]), (&json!(true), &json!([])));
        let place = "world.objects.robot.initializers.orientations.params.high";
        assert_eq!(reports[1]["warnings"][0]["path"], place);
        given.strict = true;
        let error = validate(&given, &mut captured.progress(OutputFormat::Json)).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let expected = "experiment files with warnings: 1 of 2, and --strict allows none";
        assert_eq!(error.to_string(), expected);
        given.files.pop();
        validate(&given, &mut captured.progress(OutputFormat::Table)).unwrap();
    }

    #[test]
    fn a_good_file_is_one_line() {
        let captured = Captured::default();
        validate(&args(&[quickstart()]), &mut captured.progress(OutputFormat::Table)).unwrap();
        let [line] = &captured.lines()[..] else { panic!() };
        let expected = "quickstart.json: ok: quickstart, SNES, 5 robots, 424 genes, 60 generations";
        assert!(line.ends_with(expected), "{line}");
    }

    #[test]
    fn one_bad_file_does_not_hide_another() {
        let (_dir, files) = files();
        let captured = Captured::default();
        let error =
            validate(&args(&files), &mut captured.progress(OutputFormat::Json)).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert_eq!(error.to_string(), "experiment files with problems: 2 of 3");
        let reports: Value = serde_json::from_str(&captured.lines().join("\n")).unwrap();
        assert_eq!(reports[0]["ok"], true);
        assert_eq!(reports[0]["problems"], json!([]));
        assert_eq!(reports[0]["algorithm"], "SNES");
        assert_eq!(reports[1]["ok"], false);
        assert_eq!(reports[1].get("algorithm"), None);
        let paths: Vec<_> = reports[1]["problems"]
            .as_array()
            .unwrap()
            .iter()
            .map(|problem| {
                assert!(problem["line"].as_u64().unwrap() > 1);
                problem["path"].as_str().unwrap()
            })
            .collect();
        assert_eq!(paths, ["topology.ct", "algorithm.generations"]);
        let message = reports[2]["problems"][0]["message"].as_str().unwrap();
        assert!(message.starts_with("cannot be read: "), "{message}");
    }
}

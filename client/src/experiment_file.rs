//! Experiment files: reading, checking, compiling, and submitting them.

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use evolution::ALGORITHMS;
use experiment_file::{
    ConfigError, ExperimentConfig, Problem, ScriptConfig, explain_key, inline_script, json_schema,
    limits, plain, script_path,
};
use model::limits::KEY_LEN_MAX;
use sim_core::{Simulation, TRYING_TIME_MAX};
use swarm_proto::v1::SubmitExperimentRequest;

use crate::{
    change::{Change, Json, apply_all},
    clock,
    error::{Code, Error, prefix_lines},
    examples::EXAMPLES,
    file_kind::{self, Kind},
    input::{is_stdin, read_text},
    interrupt, json,
};

/// The schema of experiment files: a sweep may have hundreds of mistakes.
static SCHEMA: LazyLock<serde_json::Value> = LazyLock::new(|| json_schema(ALGORITHMS));

/// The text of an experiment file.
#[derive(Debug, Clone)]
pub struct ExperimentFile {
    path: PathBuf,
    text: String,
}

/// Values that replace those of the file; none keeps the file's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Overrides {
    pub seed: Option<u64>,
    pub generations: Option<u64>,
    pub steps: Option<u32>,
    pub trials: Option<u32>,
}

/// An experiment file, ready for simulation.
#[derive(Debug)]
pub struct Compiled {
    pub config: ExperimentConfig,
    pub experiment: Simulation,
    /// Keys of the file without effect, and parameters of the network that keep
    /// their defaults.
    pub warnings: Vec<Problem>,
}

impl ExperimentFile {
    /// An experiment file whose text is known; the path is for messages only.
    pub fn new(path: PathBuf, text: String) -> Self {
        Self { path, text }
    }

    /// Its path, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The name of its experiment; none if the file cannot be read.
    pub fn name(&self) -> Option<String> {
        let read = ExperimentConfig::from_json(&self.text, &self.default_name(), ALGORITHMS);
        read.ok().map(|(config, _)| config.name)
    }

    /// The error that this file is invalid.
    pub fn invalid(&self, error: &ConfigError) -> Error {
        Error::invalid(&self.path, error)
    }

    /// Reads a file of UTF-8 text of at most 1 MiB; `-` is standard input. Includes the
    /// script that the file names by a path relative to its folder.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let problem = |code, key: &str, message: String| {
            let problems = vec![Problem { path: key.into(), line: None, message }];
            Error::Config { code, file: path.into(), problems }
        };
        let unreadable = |message| problem(Code::UnreadableFile, "", message);
        file_kind::expect(path, &[Kind::Experiment], "an experiment file").map_err(unreadable)?;
        let text = read_text(path, limits::FILE_BYTES)
            .map_err(|error| unreadable(format!("cannot be read: {error}{}", hint(path))))?;
        let Some((script, place)) = script_path(&text) else {
            return Ok(Self { path: path.into(), text });
        };
        let script = path.parent().unwrap_or(Path::new("")).join(script);
        let name = script.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let script = ScriptConfig {
            text: read_text(&script, limits::SCRIPT_BYTES).map_err(|what| {
                let what = format!("cannot be read: `{}`: {what}", script.display());
                problem(Code::InvalidExperiment, "task.script", what)
            })?,
            name,
        };
        Ok(Self { path: path.into(), text: inline_script(&text, place, &script) })
    }

    /// This file with changes, if it remains readable.
    pub fn changed(&self, changes: &[Change]) -> Result<Self, ConfigError> {
        if changes.is_empty() {
            return Ok(self.clone());
        }
        let read = |text: &str| ExperimentConfig::from_json(text, &self.default_name(), ALGORITHMS);
        read(&self.text)?;
        let mut file = Json::parse(&plain(&self.text));
        let missing: Vec<_> = changes.iter().filter_map(|change| change.missing(&file)).collect();
        apply_all(changes, &mut file).map_err(|problems| ConfigError {
            problems: problems.into_iter().map(unlocated).collect(),
        })?;
        let text = json::line(&file);
        match read(&text).map_err(without_lines) {
            Ok(_) => Ok(Self { path: self.path.clone(), text }),
            Err(mut error) => {
                let is_set =
                    |path: &str| changes.iter().any(|change| is_within(path, &change.path));
                for (object, message) in missing {
                    let is_of_object = |problem: &Problem| is_within(&problem.path, &object);
                    let mut problems =
                        error.problems.iter().filter(|problem| is_of_object(problem));
                    // An object that lacks more than was set is a mistake in its name.
                    if problems.any(|problem| !is_set(&problem.path)) {
                        error.problems.retain(|problem| !is_of_object(problem));
                        error.problems.push(Problem { path: object, line: None, message });
                    }
                }
                for Change { path, .. } in changes {
                    let Err(unknown) = explain_key(&SCHEMA, path) else { continue };
                    for problem in error.problems.iter_mut().filter(|problem| problem.path == *path)
                    {
                        problem.message = unknown.to_string();
                    }
                }
                Err(error)
            }
        }
    }

    /// Checks the experiment like the coordinator.
    pub fn check(&self, overrides: &Overrides) -> Result<Compiled, ConfigError> {
        let mut compiled = self.compile(overrides)?;
        let started = clock::now();
        let goes_on =
            || interrupt::goes_on() && clock::now().duration_since(started) < TRYING_TIME_MAX;
        let tried = compiled.experiment.check_starts(&compiled.config.algorithm, &goes_on)?;
        compiled.warnings.extend(tried.warning().map(str::to_owned).map(unlocated));
        Ok(compiled)
    }

    /// Prepares the experiment for simulation.
    pub fn compile(&self, overrides: &Overrides) -> Result<Compiled, ConfigError> {
        let (config, mut warnings) =
            ExperimentConfig::from_json(&self.text, &self.default_name(), ALGORITHMS)?;
        let config = overrides.apply(config)?;
        let experiment = Simulation::compile(&config)?;
        warnings.extend(experiment.uncovered_parameters().iter().cloned().map(unlocated));
        Ok(Compiled { config, experiment, warnings })
    }

    /// The request that submits it; `request_id` makes repeating it safe.
    pub fn request(&self, overrides: &Overrides, request_id: String) -> SubmitExperimentRequest {
        SubmitExperimentRequest {
            request_id,
            config_json: self.text.clone(),
            default_name: self.default_name(),
            seed: overrides.seed,
            generations: overrides.generations,
            ..SubmitExperimentRequest::default()
        }
    }

    /// Adds the name of this file to a coordinator's error about it.
    pub fn locate(&self, error: Error) -> Error {
        match error {
            Error::Input(problems) => {
                let mut problems: Vec<Problem> = problems.lines().map(Problem::parse).collect();
                // It was made from another file, or in one line.
                if !self.text.trim_end().contains('\n') {
                    problems.iter_mut().for_each(|problem| problem.line = None);
                }
                let code = Code::InvalidExperiment;
                Error::Config { code, file: self.path.clone(), problems }
            }
            error => error,
        }
    }

    /// Warnings about this file, one per line.
    pub fn warnings(&self, warnings: &[String]) -> Option<String> {
        let text = warnings.join("\n");
        let prefix = format!("warning: {}", self.path.display());
        (!text.is_empty()).then(|| prefix_lines(&text, &prefix))
    }

    /// The file's stem, cut to the length that the protocol allows.
    fn default_name(&self) -> String {
        if is_stdin(&self.path) {
            return "stdin".into();
        }
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let fits = |(start, c): &(usize, char)| start + c.len_utf8() <= KEY_LEN_MAX;
        stem.char_indices().take_while(fits).map(|(_, c)| c).collect()
    }
}

impl Overrides {
    /// Replaces the values and checks the limits of the format again.
    pub fn apply(&self, mut config: ExperimentConfig) -> Result<ExperimentConfig, ConfigError> {
        if *self == Self::default() {
            return Ok(config);
        }
        let algorithm = &mut config.algorithm;
        config.seed = self.seed.unwrap_or(config.seed);
        algorithm.generations = self.generations.unwrap_or(algorithm.generations);
        algorithm.evaluation_steps = self.steps.unwrap_or(algorithm.evaluation_steps);
        algorithm.num_evaluations = self.trials.unwrap_or(algorithm.num_evaluations);
        match ExperimentConfig::from_json(&config.to_canonical_json(), &config.name, ALGORITHMS) {
            Ok((config, _)) => Ok(config),
            Err(error) => Err(without_lines(error)),
        }
    }
}

/// Whether a path is that of the object, or of a place in it.
fn is_within(path: &str, object: &str) -> bool {
    path.strip_prefix(object).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// The next step after the path of a file that is not there, if the user meant something else.
fn hint(path: &Path) -> String {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    if path.exists() {
        String::new()
    } else if EXAMPLES.iter().any(|example| example.name == name) {
        format!("; an example has this name: run --example {name}")
    } else if name.contains('@') {
        "; the address of an individual is ID@G/I, such as 1@0/17".to_owned()
    } else {
        String::new()
    }
}

/// The problems of a generated text, without line numbers.
fn without_lines(mut error: ConfigError) -> ConfigError {
    error.problems.iter_mut().for_each(|problem| problem.line = None);
    error
}

/// A problem of the file as a whole.
fn unlocated(message: String) -> Problem {
    Problem { path: String::new(), line: None, message }
}

/// A request id of 128 random bits.
pub fn random_request_id(kind: &str) -> String {
    format!("{kind}-{:032x}", rand::random::<u128>())
}

#[cfg(test)]
pub mod tests {
    use std::fs;

    use super::*;

    /// An experiment of the project.
    pub fn shipped(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../configs/{name}.json"))
    }

    /// The smallest experiment, evolved by SNES.
    pub fn quickstart() -> PathBuf {
        shipped("quickstart")
    }

    #[test]
    fn a_request_carries_the_unchanged_file_and_its_stem() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("leader.selection.json");
        fs::write(&path, "{ \"seed\": 1 } // ü").unwrap();
        let overrides = Overrides { generations: Some(3), ..Overrides::default() };
        let request = ExperimentFile::read(&path).unwrap().request(&overrides, "id".into());
        assert_eq!(request.config_json, "{ \"seed\": 1 } // ü");
        assert_eq!(request.default_name, "leader.selection");
        assert_eq!((request.generations, request.seed), (Some(3), None));
    }

    #[test]
    fn no_shipped_experiment_has_a_warning() {
        let mut folders = vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs")];
        let mut n_files = 0;
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "json") {
                    let file = ExperimentFile::read(&path).unwrap();
                    let compiled = file.compile(&Overrides::default()).unwrap();
                    assert_eq!(compiled.warnings, [], "{}", path.display());
                    n_files += 1;
                }
            }
        }
        assert!(n_files > 30, "{n_files}");
    }

    #[test]
    fn a_long_file_name_gives_a_shorter_default_name() {
        let path = format!("x{}.json", "ü".repeat(100)).into();
        let file = ExperimentFile { path, text: String::new() };
        let request = file.request(&Overrides::default(), String::new());
        assert_eq!(request.default_name, format!("x{}", "ü".repeat(63)));
    }

    #[test]
    fn an_unreadable_file_is_a_problem_of_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let missing = dir.path().join("missing");
        let binary = dir.path().join("binary");
        fs::write(&binary, [0xff]).unwrap();
        let huge = dir.path().join("huge");
        fs::write(&huge, vec![b' '; (1 << 20) + 1]).unwrap();
        for path in [dir.path(), &missing, &binary, &huge] {
            let error = ExperimentFile::read(path).unwrap_err();
            assert_eq!(error.code(), Code::UnreadableFile);
            assert!(error.report().contains(": cannot be read: "), "{}", error.report());
        }
        let largest = dir.path().join("largest");
        fs::write(&largest, vec![b' '; 1 << 20]).unwrap();
        assert!(ExperimentFile::read(&largest).is_ok());
    }

    #[test]
    fn overrides_replace_values_of_the_file() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let overrides = Overrides {
            seed: Some(u64::MAX),
            generations: Some(2),
            steps: Some(3),
            trials: Some(4),
        };
        let config = file.compile(&overrides).unwrap().config;
        let algorithm = config.algorithm;
        assert_eq!((config.seed, algorithm.generations), (u64::MAX, 2));
        assert_eq!((algorithm.evaluation_steps, algorithm.num_evaluations), (3, 4));
    }

    #[test]
    fn changes_apply_to_the_file_and_not_to_its_canonical_form() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let original = Change::new("semantics".into(), Json::parse("original"));
        let changed = file.changed(&[original]).unwrap();
        let config = |file: &ExperimentFile| file.compile(&Overrides::default()).unwrap().config;
        assert!(!config(&changed).topology.bias_in_gain);
        assert!(config(&file).topology.bias_in_gain);
        assert_eq!(changed.path, file.path);
    }

    #[test]
    fn all_mistakes_of_changes_are_reported_at_once() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let change = |path: &str, value| Change::new(path.into(), Json::parse(value));
        let wrong =
            [change("algorithm.population_sise", "3"), change("algorithm.generations", "0")];
        let error = file.changed(&wrong).unwrap_err().to_string();
        assert!(error.contains("did you mean `population_size`?"), "{error}");
        assert!(error.contains("algorithm.generations: must be between"), "{error}");
        assert!(!error.contains("line "), "{error}");
        let nowhere = [change("seed.x", "3"), change("name.y", "0")];
        assert_eq!(file.changed(&nowhere).unwrap_err().problems.len(), 2);
    }

    #[test]
    fn a_change_of_an_unknown_object_names_the_known_ones() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let path = "world.objects.robotA.num_instances".into();
        let error = file.changed(&[Change::new(path, Json::from(3))]).unwrap_err();
        let expected = "world.objects.robotA: the file has none; did you mean `robot`?";
        assert_eq!(error.to_string(), expected);
        // Its name begins like that of an object with another mistake.
        let change = |path: &str, value| Change::new(path.into(), Json::parse(value));
        let wrong = [
            change("world.objects.rob.num_instances", "3"),
            change("world.objects.robot.num_instances", "-3"),
        ];
        let error = file.changed(&wrong).unwrap_err().to_string();
        for part in
            ["world.objects.rob: the file has none", "world.objects.robot.num_instances: must"]
        {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn a_wrong_value_in_an_object_that_the_file_lacks_is_at_fault_itself() {
        let mut file = ExperimentFile::read(&quickstart()).unwrap();
        let params = ",\n                \"params\": {\"encoding\": \"real\"}";
        file.text = file.text.replace(params, "");
        let path = "algorithm.populations.network.params.eta_sigma";
        assert!(
            Change::new(path.into(), Json::from(3)).missing(&Json::parse(&file.text)).is_some()
        );
        for value in ["-3", "many"] {
            let error = file.changed(&[Change::new(path.into(), Json::parse(value))]).unwrap_err();
            assert!(error.problems.iter().all(|problem| problem.path == path), "{error}");
        }
    }

    #[test]
    fn a_path_without_its_beginning_gets_it() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let error = file.changed(&[Change::new("population_size".into(), Json::from(10))]);
        let error = error.unwrap_err().to_string();
        assert!(error.ends_with("; did you mean `algorithm.population_size`?"), "{error}");
    }

    #[test]
    fn overrides_obey_the_limits_of_files() {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let overrides =
            Overrides { steps: Some(1 + limits::STEPS), trials: Some(0), ..Overrides::default() };
        let error = file.compile(&overrides).unwrap_err();
        let expected = ["algorithm.evaluation_steps", "algorithm.num_evaluations"];
        assert_eq!(error.problems.iter().map(|p| &*p.path).collect::<Vec<_>>(), expected);
        assert!(error.problems.iter().all(|problem| problem.line.is_none()));
    }

    #[test]
    fn request_ids_differ() {
        assert_ne!(random_request_id("run"), random_request_id("run"));
    }

    #[test]
    fn warnings_name_the_file() {
        let file = ExperimentFile { path: "a.json".into(), text: String::new() };
        assert_eq!(file.warnings(&[]), None);
        let warnings = ["line 1: x".to_owned(), "y".to_owned()];
        let expected = "warning: a.json: line 1: x\nwarning: a.json: y";
        assert_eq!(file.warnings(&warnings).as_deref(), Some(expected));
    }
}

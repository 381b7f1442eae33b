//! What is in `results/` is what this program computes: whoever repeats a run gets
//! its bits. The whole of it takes hours; its beginning and its champion do not.

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
};

use evolution::Digest;
use experiment_file::ExperimentConfig;
use harness::{swarmctl, workspace_file};
use serde_json::Value;

/// Generations of each run that are computed again: `SWARM_TEST_GENERATIONS`, 1 without
/// it. `.ci/run` takes 3, which is a minute of CPU.
fn n_generations() -> usize {
    let text = env::var("SWARM_TEST_GENERATIONS").unwrap_or_else(|_| "1".to_owned());
    text.parse().unwrap_or_else(|_| panic!("SWARM_TEST_GENERATIONS is {text}, not a number"))
}

/// A run in `results/`.
struct Run {
    /// Of its files, without their endings.
    stem: String,
    champion: Value,
    history: Vec<BTreeMap<String, String>>,
}

impl Run {
    fn read(champion: &Path) -> Self {
        let stem = champion.file_stem().unwrap().to_str().unwrap().to_owned();
        let champion = serde_json::from_str(&fs::read_to_string(champion).unwrap()).unwrap();
        let history = fs::read_to_string(results(&format!("histories/{stem}.csv"))).unwrap();
        let mut lines = history.lines().map(|line| line.split(',').map(str::to_owned));
        let keys: Vec<String> = lines.next().unwrap().collect();
        let history = lines.map(|values| keys.iter().cloned().zip(values).collect()).collect();
        Self { stem, champion, history }
    }

    fn all() -> Vec<Self> {
        let entries = fs::read_dir(results("champions")).unwrap();
        let mut champions: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        champions.sort();
        champions.iter().map(|path| Self::read(path)).collect()
    }

    /// Those that this version of the simulation computed. What an earlier one computed
    /// can be repeated with that one only.
    fn repeatable() -> Vec<Self> {
        let mut runs = Self::all();
        runs.retain(Self::is_repeatable);
        runs
    }

    fn is_repeatable(&self) -> bool {
        let simulation = self.champion["simulation"].as_str().unwrap();
        let is_ours = simulation == sim_core::FINGERPRINT;
        if !is_ours {
            println!("SKIPPED: results/*/{} is of {simulation}", self.stem);
        }
        is_ours
    }

    fn seed(&self) -> String {
        self.champion["seed"].to_string()
    }

    fn config_path(&self) -> String {
        let name = self.champion["name"].as_str().unwrap();
        workspace_file(&format!("configs/{name}.json")).to_str().unwrap().to_owned()
    }

    /// The experiment file, with the run's seed.
    fn config(&self) -> ExperimentConfig {
        let text = fs::read_to_string(self.config_path()).unwrap();
        let (mut config, _) =
            ExperimentConfig::from_json(&text, "", evolution::ALGORITHMS).unwrap();
        config.seed = self.champion["seed"].as_u64().unwrap();
        config
    }
}

fn results(path: &str) -> PathBuf {
    workspace_file("results").join(path)
}

#[test]
fn runs_are_complete_and_of_the_shipped_experiments() {
    let runs = Run::all();
    assert!(!runs.is_empty());
    for run in &runs {
        let config = run.config();
        assert_eq!(run.stem, format!("{}-{}", config.name, config.seed));
        if run.is_repeatable() {
            let digest = Digest::of_config(&config, sim_core::FINGERPRINT);
            assert_eq!(run.champion["config_digest"], digest.to_string());
        }
        assert_eq!(run.history.len() as u64, config.algorithm.generations, "{}", run.stem);
        for (i, generation) in run.history.iter().enumerate() {
            assert_eq!(generation["generation"], i.to_string(), "{}", run.stem);
        }
    }
    assert_eq!(fs::read_dir(results("histories")).unwrap().count(), runs.len());
}

#[test]
fn runs_that_are_repeated_begin_with_the_same_bits() {
    let n_generations = n_generations();
    for run in Run::repeatable() {
        let data_dir = tempfile::tempdir().unwrap();
        let generations = n_generations.to_string();
        let lines = swarmctl([
            "run",
            &run.config_path(),
            "--seed",
            &run.seed(),
            "--generations",
            &generations,
            "--data-dir",
            data_dir.path().to_str().unwrap(),
        ])
        .expect_success()
        .json_lines();
        let again: Vec<&str> = lines[..n_generations]
            .iter()
            .map(|generation| generation["digest"].as_str().unwrap())
            .collect();
        let published: Vec<&str> = run.history[..n_generations]
            .iter()
            .map(|generation| generation["digest"].as_str())
            .collect();
        assert_eq!(again, published, "{}", run.stem);
    }
}

#[test]
fn champions_have_the_fitness_for_which_they_were_chosen() {
    for run in Run::repeatable() {
        // Means of a distribution were in no generation; evaluations are about those.
        let trials = run.champion["trial_fitness"].as_array().unwrap();
        if trials.is_empty() {
            continue;
        }
        let again = swarmctl([
            "simulate",
            &run.config_path(),
            "--genotype",
            results(&format!("champions/{}.json", run.stem)).to_str().unwrap(),
            "--seed",
            &run.seed(),
            "--generation",
            &run.champion["generation"].to_string(),
        ])
        .expect_success()
        .json();
        let bits = |fitness: &Value| fitness.as_f64().unwrap().to_bits();
        let again: Vec<u64> = again["trials"]
            .as_array()
            .unwrap()
            .iter()
            .map(|trial| bits(&trial["fitness"]))
            .collect();
        assert_eq!(again, trials.iter().map(bits).collect::<Vec<_>>(), "{}", run.stem);
    }
}

/// Trials do not depend on how many there are, so a few of them are enough.
#[test]
fn evaluations_that_are_repeated_have_the_same_bits() {
    let evaluations = fs::read_dir(results("evaluations")).unwrap();
    let mut evaluations: Vec<PathBuf> = evaluations.map(|entry| entry.unwrap().path()).collect();
    evaluations.sort();
    assert!(!evaluations.is_empty());
    for evaluation in evaluations {
        let stem = evaluation.file_name().unwrap().to_str().unwrap();
        let summary: Value =
            serde_json::from_str(&fs::read_to_string(evaluation.join("summary.json")).unwrap())
                .unwrap();
        let run = Run::read(&results(&format!("champions/{stem}.json")));
        if !run.is_repeatable() {
            continue;
        }
        let again = tempfile::tempdir().unwrap();
        let mut args: Vec<String> =
            ["evaluate", "--local", "--trials", "2", "--genotype"].map(str::to_owned).into();
        args.push(results(&format!("champions/{stem}.json")).to_str().unwrap().to_owned());
        args.extend(["--config".to_owned(), run.config_path()]);
        args.extend(["--base".to_owned(), format!("seed={}", run.seed())]);
        args.extend(["--steps".to_owned(), summary["steps"].to_string()]);
        args.extend(["--to".to_owned(), again.path().to_str().unwrap().to_owned()]);
        for (index, condition) in summary["conditions"].as_array().unwrap().iter().enumerate() {
            let changes = condition["changes"].as_object().unwrap().iter();
            let changes = changes.map(|(path, value)| format!("{path}={value}"));
            if index == 0 {
                args.extend(changes.flat_map(|change| ["--base".to_owned(), change]));
            } else {
                let changes: Vec<String> = changes.collect();
                args.extend(["--set".to_owned(), changes.join("; ")]);
            }
        }
        swarmctl(&args).expect_success();
        // Without the conditions' names: here they are what they change.
        let rows = |directory: &Path| -> Vec<String> {
            let text = fs::read_to_string(directory.join("trials.csv")).unwrap();
            let rows = text.lines().skip(1).map(|row| row.rsplitn(5, ',').collect::<Vec<_>>());
            rows.filter(|row| ["0", "1"].contains(&row[3])).map(|row| row[..4].join(",")).collect()
        };
        assert_eq!(rows(again.path()), rows(&evaluation), "{stem}");
    }
}

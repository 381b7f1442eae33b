//! Commands without a fleet: checking experiment files, and simulating episodes.

use std::{
    fs,
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use harness::{Experiment, Outcome, swarmctl, swarmctl_process, workspace_file};
use serde_json::{Value, json};

fn simulate(config: &Path, args: &[&str]) -> Outcome {
    let config = config.to_str().unwrap();
    swarmctl(["simulate", config].iter().chain(args))
}

fn simulated(config: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&simulate(config, args).expect_success().stdout).unwrap()
}

/// Bits of the fitness of each trial.
fn fitness_bits(trials: &[Value], fitness: impl Fn(&Value) -> &Value) -> Vec<u64> {
    trials.iter().map(|trial| fitness(trial).as_f64().unwrap().to_bits()).collect()
}

fn shipped() -> Vec<PathBuf> {
    let entries = fs::read_dir(workspace_file("configs")).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    paths
}

#[test]
fn every_shipped_experiment_can_be_simulated() {
    let paths = shipped();
    assert!(paths.len() >= 9, "{paths:?}");
    for path in paths {
        let simulation = simulated(&path, &["--trials", "2", "--steps", "120"]);
        let trials = simulation["trials"].as_array().unwrap();
        assert_eq!(trials.len(), 2);
        for of in trials.iter().chain([&simulation["mean"]]) {
            assert!(of["fitness"].as_f64().is_some_and(f64::is_finite), "{path:?}: {of}");
            let metrics = of["metrics"].as_object().unwrap();
            assert!(!metrics.is_empty(), "{path:?}");
            assert!(metrics.values().all(|m| m.as_f64().is_some_and(f64::is_finite)), "{of}");
        }
    }
}

#[test]
fn an_interrupted_trace_leaves_no_file() {
    let quickstart = workspace_file("configs/quickstart.json");
    for signal in ["INT", "TERM"] {
        let directory = tempfile::tempdir().unwrap();
        let names = || -> Vec<_> {
            let entries = fs::read_dir(directory.path()).unwrap();
            entries.map(|entry| entry.unwrap().file_name()).collect()
        };
        let trace = directory.path().join("trace.csv");
        let config = quickstart.to_str().unwrap();
        let args = ["simulate", config, "--trials", "1000", "--steps", "100000", "--trace"];
        let mut simulating = swarmctl_process(args.iter().copied().chain(trace.to_str()));
        let mut n_looks = 0;
        while names().is_empty() {
            n_looks += 1;
            assert!(n_looks < 3000, "the trace has not begun");
            thread::sleep(Duration::from_millis(20));
        }
        simulating.signal(signal);
        assert_eq!(simulating.wait().code(), Some(130), "{signal}");
        assert_eq!(names(), [""; 0], "{signal}");
    }
}

#[test]
fn a_champion_in_the_worlds_of_its_generation_has_the_fitness_that_is_stored() {
    let directory = tempfile::tempdir().unwrap();
    let experiment = Experiment::small(4);
    let path = experiment.path();
    let data_dir = directory.path().to_str().unwrap();
    // The seed differs from the file's.
    let args = ["run", path.to_str().unwrap(), "--seed", "99", "--data-dir", data_dir];
    let lines = swarmctl(args).expect_success().json_lines();
    let file = lines.last().unwrap()["champion_file"].as_str().unwrap();
    let champion: Value = serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let generation = champion["generation"].to_string();
    // The champion file has the seed of its evolution.
    assert_eq!(champion["simulation"], sim_core::FINGERPRINT);
    assert_eq!(champion["seed"], 99);

    let args = ["--genotype", file, "--seed", "99", "--generation", &generation];
    let simulation = simulated(&path, &args);
    let stored = fitness_bits(champion["trial_fitness"].as_array().unwrap(), |fitness| fitness);
    let again = fitness_bits(simulation["trials"].as_array().unwrap(), |trial| &trial["fitness"]);
    assert_eq!(again, stored);
    assert_eq!(simulation["mean"]["fitness"], champion["fitness_when_chosen"]);
}

#[test]
fn a_trace_shows_every_robot_in_every_step_and_changes_no_bit() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("trace.csv");
    for config in ["leader_selection_snes", "light_follower_snes", "orientation_consensus_snes"] {
        let config = workspace_file(&format!("configs/{config}.json"));
        let args = ["--trials", "2", "--steps", "50", "--seed", "5"];
        let unseen = simulated(&config, &args);
        let with_trace = [&args[..], &["--force", "--trace", path.to_str().unwrap()]].concat();
        let seen = simulated(&config, &with_trace);
        let fitness = |simulation: &Value| {
            fitness_bits(simulation["trials"].as_array().unwrap(), |trial| &trial["fitness"])
        };
        assert_eq!(fitness(&seen), fitness(&unseen));
        assert_eq!(seen["mean"], unseen["mean"]);

        let trace = fs::read_to_string(&path).unwrap();
        let mut lines = trace.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let heading = lines.next().unwrap();
        let column = |name: &str| heading.iter().position(|cell| *cell == name).unwrap();
        let rows: Vec<Vec<&str>> = lines.collect();
        assert_eq!(rows.len(), 2 * 50 * 10);
        assert_eq!(seen["trace_rows"], rows.len());
        for (index, row) in rows.iter().enumerate() {
            assert_eq!(row.len(), heading.len());
            let expected = [index / 500, index / 10 % 50, index % 10].map(|n| n.to_string());
            assert_eq!(row[..3], expected);
            for axis in ["x_cm", "y_cm"] {
                let position: f64 = row[column(axis)].parse().unwrap();
                assert!((0.0..1000.0).contains(&position), "{row:?}");
            }
        }
    }
}

#[test]
fn unusable_genotypes_and_traces_are_refused_in_one_line() {
    let directory = tempfile::tempdir().unwrap();
    let genotype = directory.path().join("genotype.json");
    fs::write(&genotype, "[0.5, 0.5]").unwrap();
    let genotype = genotype.to_str().unwrap();
    let inside_a_file = format!("{genotype}/trace.csv");
    let config = workspace_file("configs/quickstart.json");
    for (args, expected) in [
        (["--genotype", genotype], "has 2 genes, the experiment's have 424"),
        (["--genotype", config.to_str().unwrap()], "no genotype in"),
        (["--genotype", "missing.json"], "missing.json"),
        (["--trace", &inside_a_file], "cannot write"),
    ] {
        let outcome = simulate(&config, &args);
        assert_eq!(outcome.code, Some(2), "{outcome:#?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
        assert_eq!(outcome.stdout, "");
    }
    let args = ["--coordinator", "http://127.0.0.1:1", "--experiment", "3"];
    assert_eq!(simulate(&config, &args).code, Some(4));
}

#[test]
fn a_file_is_validated_with_all_its_problems() {
    let bad = Experiment::small(1).edit(|e| {
        // More problems than a refusal over the wire could carry.
        for i in 0..40 {
            e["topology"]["stimuli"][format!("no-such-sensor-{i}{}", "x".repeat(80))] =
                json!({"n": 1, "sensor": "sonar"});
        }
        e["algorithm"]["generations"] = json!("many");
    });
    let good = Experiment::small(3);
    let (bad, good) = (bad.path(), good.path());
    let outcome = swarmctl(["validate", good.to_str().unwrap(), bad.to_str().unwrap()]);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    let reports: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!((&reports[0]["ok"], &reports[1]["ok"]), (&json!(true), &json!(false)));
    assert_eq!((&reports[0]["robots"], &reports[0]["generations"]), (&json!(10), &json!(3)));
    assert!(reports[0]["genotype_len"].as_u64().unwrap() > 400);
    let problems = reports[1]["problems"].as_array().unwrap();
    assert!(problems.len() > 40, "{}", problems.len());
    let prefix = format!("{}: line ", bad.display());
    let n_lines = outcome.stderr.lines().filter(|line| line.starts_with(&prefix)).count();
    assert_eq!(n_lines, problems.len());
    assert!(outcome.stderr.contains("algorithm.generations: "), "{}", outcome.stderr);

    // `run` reports the same, and leaves no files.
    let directory = tempfile::tempdir().unwrap();
    let data_dir = directory.path().join("data");
    let args = ["run", bad.to_str().unwrap(), "--data-dir", data_dir.to_str().unwrap()];
    let run = swarmctl(args);
    assert_eq!(run.code, Some(2), "{run:#?}");
    assert_eq!(run.stderr.lines().filter(|line| line.starts_with(&prefix)).count(), n_lines);
    assert!(!data_dir.exists());
    assert_eq!(swarmctl(["validate", good.to_str().unwrap()]).code, Some(0));
}

#[test]
fn every_shipped_experiment_is_valid() {
    let outcome = swarmctl([PathBuf::from("validate")].into_iter().chain(shipped()));
    let reports: Value = serde_json::from_str(&outcome.expect_success().stdout).unwrap();
    assert!(reports.as_array().unwrap().iter().all(|report| report["ok"] == true));
}

#[test]
fn the_schema_knows_the_keys_of_experiment_files() {
    let outcome = swarmctl(["schema"]).expect_success();
    let schema: Value = serde_json::from_str(&outcome.stdout).unwrap();
    for key in ["topology", "algorithm", "world"] {
        assert!(schema["properties"][key].is_object(), "{key}");
    }
}

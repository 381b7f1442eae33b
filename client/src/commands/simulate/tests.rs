//! Simulating shipped experiments with genotypes from all sources.

use std::{fs, path::PathBuf};

use serde_json::{Value, json};
use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::*;
use crate::{
    args::{ChangedArg, IsaArgs, SeedArg, StepsArg},
    experiment_file::tests::quickstart,
    fake_coordinator::{FakeCoordinator, Script},
    output_file::Overwrite,
    output_format::OutputFormat,
    progress::tests::Captured,
};

/// An address without a server.
const NOWHERE: &str = "http://127.0.0.1:1";
/// Genes of the quickstart.
const N_GENES: usize = 424;

fn args() -> SimulateArgs {
    SimulateArgs {
        subject: quickstart(),
        genotype: None,
        experiment: None,
        changed: ChangedArg::default(),
        seed: SeedArg { seed: Some(7) },
        generation: None,
        trials: Some(2),
        steps: StepsArg { steps: Some(20) },
        trace: None,
        trace_columns: Vec::new(),
        overwrite: Overwrite::default(),
        isa: IsaArgs::default(),
    }
}

fn settings(coordinator: &str) -> Settings {
    Settings { coordinator: Some(coordinator.to_owned()), ..Settings::default() }
}

async fn run(coordinator: &str, args: &SimulateArgs) -> Result<Value, Error> {
    let captured = Captured::default();
    simulate(settings(coordinator), args, &mut captured.progress(OutputFormat::Json)).await?;
    Ok(serde_json::from_str(&captured.lines().join("\n")).unwrap())
}

fn file(dir: &tempfile::TempDir, genotype: &Value) -> Option<PathBuf> {
    let path = dir.path().join("genotype.json");
    fs::write(&path, genotype.to_string()).unwrap();
    Some(path)
}

#[tokio::test]
async fn a_champion_is_the_same_from_a_file_and_from_a_coordinator() {
    let genotype: Vec<f64> = (0..N_GENES).map(|i| i as f64 / N_GENES as f64).collect();
    let (fake, connection) = FakeCoordinator::serve(Script {
        experiment: Experiment { id: 3, ..Experiment::default() },
        champion: Some(GetChampionResponse { genotype: genotype.clone(), ..Default::default() }),
        ..Script::default()
    })
    .await;
    let from_coordinator = SimulateArgs { experiment: "3".parse().ok(), ..args() };
    let fetched = run(connection.address(), &from_coordinator).await.unwrap();
    let dir = tempfile::tempdir().unwrap();
    let from_file = SimulateArgs { genotype: file(&dir, &json!(genotype)), ..args() };
    let read = run(NOWHERE, &from_file).await.unwrap();
    assert_eq!(fetched["trials"], read["trials"]);
    assert_eq!(fetched["genotype"], "champion of experiment 3");

    // A genotype of another file is accepted on request only.
    fake.script(|script| script.experiment.config_digest = "ab".repeat(32));
    let error = run(connection.address(), &from_coordinator).await.unwrap_err();
    assert_eq!(error.exit_code(), 2);
    for part in ["champion of experiment 3", "quickstart.json", "--changed-conditions"] {
        assert!(error.to_string().contains(part), "{error}");
    }
    let changed = ChangedArg { changed_conditions: true };
    let knowingly = SimulateArgs { changed, ..from_coordinator };
    assert_eq!(run(connection.address(), &knowingly).await.unwrap(), fetched);

    let unknown = SimulateArgs { experiment: "4".parse().ok(), ..args() };
    assert_eq!(run(connection.address(), &unknown).await.unwrap_err().exit_code(), 3);
}

#[tokio::test]
async fn seed_and_generation_choose_the_worlds() {
    let dir = tempfile::tempdir().unwrap();
    let genotype = file(&dir, &json!({"genotype": vec![0.5; N_GENES]}));
    let first = SimulateArgs { genotype, ..args() };
    let fitness = async |args: &SimulateArgs| run(NOWHERE, args).await.unwrap()["mean"].clone();
    let same = fitness(&first).await;
    assert_eq!(fitness(&first).await, same);
    assert_ne!(
        fitness(&SimulateArgs { seed: SeedArg { seed: Some(8) }, ..first.clone() }).await,
        same
    );
    assert_ne!(fitness(&SimulateArgs { generation: Some(1), ..first }).await, same);
}

#[tokio::test]
async fn means_are_over_the_trials() {
    let simulation = run(NOWHERE, &args()).await.unwrap();
    let trials = simulation["trials"].as_array().unwrap();
    assert_eq!(trials.len(), 2);
    for of in ["/fitness", "/metrics/one_leader"] {
        let number = |value: &Value| value.pointer(of).unwrap().as_f64().unwrap();
        let mean = (number(&trials[0]) + number(&trials[1])) / 2.0;
        assert_eq!(number(&simulation["mean"]), mean);
    }
}

#[tokio::test]
async fn the_text_is_a_table() {
    let captured = Captured::default();
    let mut progress = captured.progress(OutputFormat::Table);
    simulate(settings(NOWHERE), &args(), &mut progress).await.unwrap();
    let lines = captured.lines();
    assert_eq!(lines[0], "quickstart: random genotype, seed 7, generation 0, 20 steps per trial");
    let first_cells: Vec<&str> =
        lines[1..].iter().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert_eq!(first_cells, ["trial", "0", "1", "mean"]);
}

#[tokio::test]
async fn genotypes_that_do_not_fit_are_refused_before_a_file_is_touched() {
    let dir = tempfile::tempdir().unwrap();
    let trace = dir.path().join("trace.csv");
    fs::write(&trace, "precious").unwrap();
    let mut outside = vec![0.5; N_GENES];
    outside[7] = 1.5;
    for (genotype, expected) in
        [(vec![0.5; 3], "has 3 genes, the experiment's have 424"), (outside, "gene 7 is 1.5")]
    {
        let genotype = file(&dir, &json!(genotype));
        let overwrite = Overwrite { force: true };
        let args = SimulateArgs { genotype, trace: Some(trace.clone()), overwrite, ..args() };
        let error = run(NOWHERE, &args).await.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(fs::read_to_string(&trace).unwrap(), "precious");
    }
}

#[tokio::test]
async fn a_trace_that_cannot_be_written_is_bad_input() {
    let dir = tempfile::tempdir().unwrap();
    let mut paths = vec![dir.path().to_owned(), dir.path().join("missing/trace.csv")];
    if PathBuf::from("/dev/full").exists() {
        paths.push("/dev/full".into());
    }
    for path in paths {
        let error = run(NOWHERE, &SimulateArgs { trace: Some(path.clone()), ..args() }).await;
        let error = error.unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let report = error.report();
        assert!(report.starts_with(&format!("error: cannot write {}: ", path.display())));
        assert_eq!(report.lines().count(), 1);
    }
}

#[tokio::test]
async fn a_file_with_problems_is_not_simulated() {
    let args = SimulateArgs { steps: StepsArg { steps: Some(u32::MAX) }, ..args() };
    let error = run(NOWHERE, &args).await.unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.report().contains("quickstart.json: algorithm.evaluation_steps: "));
}

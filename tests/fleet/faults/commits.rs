//! Coordinators that die at a chosen step.

use std::{fs, os::unix::process::ExitStatusExt as _, process::Command};

use harness::{CoordinatorProcess, Outcome, WorkerProcess, binary, swarmctl_process};

use super::{GENERATIONS, TINY, resumed_at};

const SIGABRT: i32 = 6;

/// Waits until the coordinator has died at the given step.
fn wait_for_death(coordinator: &mut CoordinatorProcess, step: &str) {
    let status = coordinator.process.wait();
    assert_eq!(status.signal(), Some(SIGABRT), "the failpoint killed it");
    coordinator.process.wait_for("last words", |line| line["step"] == step);
}

/// A coordinator that dies at the `passage`-th time of a step has committed `n_committed`
/// generations, and continues from there.
fn dies_and_goes_on(step: &str, passage: u64, n_committed: u64) {
    let mut coordinator = CoordinatorProcess::start_armed(&format!("kill {step} {passage}"));
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    let watch = coordinator.watch(id);
    wait_for_death(&mut coordinator, step);
    assert_eq!(coordinator.n_committed(id), n_committed);
    coordinator.restart();
    if n_committed < GENERATIONS {
        assert_eq!(resumed_at(&coordinator), n_committed);
    }
    TINY.assert_undisturbed(watch);
}

#[test]
fn killed_before_a_commit() {
    dies_and_goes_on("before commit", 3, 2);
}

#[test]
fn killed_within_a_commit_after_the_history_before_the_checkpoint() {
    dies_and_goes_on("history written", 3, 2);
}

#[test]
fn killed_within_a_commit_after_the_last_statement() {
    dies_and_goes_on("commit prepared", 3, 2);
}

#[test]
fn killed_after_a_commit_before_the_engine_knows() {
    dies_and_goes_on("committed", 3, 3);
}

#[test]
fn killed_before_the_last_commit() {
    dies_and_goes_on("before commit", GENERATIONS, GENERATIONS - 1);
}

#[test]
fn killed_within_the_last_commit() {
    dies_and_goes_on("commit prepared", GENERATIONS, GENERATIONS - 1);
}

#[test]
fn killed_after_the_last_commit_before_the_engine_knows() {
    dies_and_goes_on("committed", GENERATIONS, GENERATIONS);
}

#[test]
fn killed_between_the_store_and_the_driver_of_a_submission() {
    let step = "experiment stored";
    let mut coordinator = CoordinatorProcess::start_armed(&format!("kill {step} 1"));
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let experiment = (TINY.make)();
    let (url, path) = (coordinator.url(), experiment.path());
    let submission = swarmctl_process(["--coordinator", &url, "submit", path.to_str().unwrap()]);
    wait_for_death(&mut coordinator, step);
    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 0);
    TINY.assert_undisturbed(coordinator.watch(1));
    // The client may have repeated the submission under the same request id.
    drop(submission);
    let list = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(list.as_array().unwrap().len(), 1);
}

#[test]
fn killed_before_a_cancellation_is_stored() {
    let mut coordinator = CoordinatorProcess::start_armed("kill before change 1");
    let id = TINY.submit(&coordinator);
    let cancelled = coordinator.swarmctl(&["cancel", &id.to_string()]);
    assert_eq!(
        cancelled.code,
        Some(4),
        "the client reports that the outcome is unknown: {cancelled:?}"
    );
    wait_for_death(&mut coordinator, "before change");
    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 0);
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    TINY.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn killed_after_a_cancellation_is_stored() {
    let mut coordinator = CoordinatorProcess::start_armed("kill changed 1");
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    coordinator.wait_for_generation(1);
    let cancelling =
        swarmctl_process(["--coordinator", &coordinator.url(), "cancel", &id.to_string()]);
    wait_for_death(&mut coordinator, "changed");
    drop(cancelling);
    coordinator.restart();
    let (code, finished) = coordinator.watch(id).end();
    assert_eq!(code, Some(6));
    assert_eq!(finished.last["state"], "cancelled");
    let n_done = finished.generations.len();
    assert!(n_done >= 2);
    assert_eq!(finished.digests()[..n_done], TINY.undisturbed()[..n_done]);
}

#[test]
fn a_write_ahead_log_torn_by_a_power_cut_costs_its_last_generation() {
    let mut coordinator = CoordinatorProcess::start_armed("kill committed 3");
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    wait_for_death(&mut coordinator, "committed");
    let log = coordinator.data_dir().join("swarmevo.sqlite3-wal");
    let log = fs::File::options().write(true).open(log).unwrap();
    log.set_len(log.metadata().unwrap().len() - 1).unwrap();
    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 2, "two of three generations are whole");
    TINY.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_coordinator_whose_driver_panics_ends_with_a_line_and_goes_on_when_started_again() {
    let mut coordinator = CoordinatorProcess::start_armed("panic event 20");
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    let watch = coordinator.watch(id);
    assert_eq!(coordinator.process.wait().code(), Some(1));
    coordinator.process.wait_for("its reason", |line| {
        let message = line["message"].as_str().unwrap_or_default();
        message.contains("the driver ended") && message.contains("failpoint event")
    });
    coordinator.restart();
    resumed_at(&coordinator);
    TINY.assert_undisturbed(watch);
}

#[test]
fn a_run_in_one_process_ends_with_its_driver_and_goes_on_when_repeated() {
    let data_dir = tempfile::tempdir().unwrap();
    let experiment = (TINY.make)();
    let mut run = Command::new(binary("swarmctl"));
    run.args(["--output", "json", "run", "--workers", "2"])
        .arg(experiment.path())
        .arg("--data-dir")
        .arg(data_dir.path());
    let broken = Outcome::of_command(run.env("SWARM_FAILPOINT", "panic event 20"));
    assert_eq!(broken.code, Some(1), "{broken:#?}");
    assert!(broken.stderr.contains("the driver ended"), "{}", broken.stderr);

    let lines =
        Outcome::of_command(run.env_remove("SWARM_FAILPOINT")).expect_success().json_lines();
    let digests: Vec<&str> = lines.iter().filter_map(|line| line["digest"].as_str()).collect();
    assert_eq!(digests, TINY.undisturbed());
}

//! Experiments continue after their end, to the bits of one that never ended. They can be found,
//! archived and deleted.

use harness::{CoordinatorProcess, Experiment, WorkerProcess, undisturbed};
use serde_json::Value;

const GENERATIONS: u64 = 4;

/// An experiment, once it has completed.
fn ended(coordinator: &CoordinatorProcess, id: &str) -> Value {
    coordinator.swarmctl(&["watch", "--quiet", id]).expect_success().json()
}

#[test]
fn an_experiment_goes_on_after_every_end_to_the_bits_of_one_that_never_ended() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let long = Experiment::small(GENERATIONS);
    let expected = undisturbed(&long);

    // Extended.
    let short = Experiment::small(1);
    let id = coordinator.submit(&short.path()).to_string();
    ended(&coordinator, &id);
    coordinator.swarmctl(&["archive", &id]).expect_success();
    assert_eq!(coordinator.swarmctl(&["resume", &id, "--generations", "1"]).code, Some(2));
    assert_eq!(coordinator.swarmctl(&["resume", &id]).code, Some(3));
    let generations = GENERATIONS.to_string();
    coordinator.swarmctl(&["resume", &id, "--generations", &generations]).expect_success();
    assert_eq!(coordinator.swarmctl(&["delete", &id]).code, Some(3), "it has not ended");
    let extended = coordinator.watch(1).finish();
    assert_eq!(extended.digests(), expected);

    // Cancelled, and then failed.
    let id = coordinator.submit(&long.path());
    let number = id.to_string();
    coordinator.wait_for_generation(0);
    coordinator.swarmctl(&["cancel", &number]).expect_success();
    let cancelled = coordinator.swarmctl(&["watch", "--quiet", &number]);
    assert_eq!(cancelled.code, Some(6));
    assert!(coordinator.n_committed(id) < GENERATIONS, "it was cancelled within the run");
    coordinator.process.kill();
    coordinator
        .database()
        .execute("UPDATE experiments SET state = 'failed' WHERE id = 2", [])
        .unwrap();
    coordinator.restart();
    let extended = coordinator.swarmctl(&["resume", &number, "--generations", "1000"]);
    assert_eq!(extended.code, Some(3), "it has failed");
    coordinator.swarmctl(&["resume", &number]).expect_success();
    coordinator.swarmctl(&["cancel", &number]).expect_success();
    coordinator.swarmctl(&["resume", &number]).expect_success();
    assert_eq!(coordinator.watch(id).finish().digests(), expected);
    assert_eq!(ended(&coordinator, "1")["digest"], ended(&coordinator, "2")["digest"]);

    // The file is submitted again, and gives the same result.
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("again.json");
    std::fs::write(&file, coordinator.swarmctl(&["get", &number]).expect_success().stdout).unwrap();
    let again = coordinator.submit(&file);
    assert_eq!(coordinator.watch(again).finish().digests(), expected);
}

#[test]
fn experiments_are_found_by_labels_and_names_and_deleted() {
    let coordinator = CoordinatorProcess::start();
    let experiment = Experiment::small(1).edit(|file| file["name"] = "one".into());
    let path = experiment.path();
    let path = path.to_str().unwrap();
    coordinator.swarmctl(&["submit", path, "--label", "user=ada"]).expect_success();
    let list = |filter: &[&str]| {
        let args = [&["list"], filter].concat();
        coordinator.swarmctl(&args).expect_success().json().as_array().unwrap().len()
    };
    assert_eq!((list(&["--label", "user=ada"]), list(&["--label", "user=grace"])), (1, 0));
    coordinator.swarmctl(&["label", "one", "user=grace"]).expect_success();
    assert_eq!(list(&["--label", "user=grace", "--state", "running"]), 1);
    coordinator.swarmctl(&["cancel", "one"]).expect_success();
    coordinator.swarmctl(&["archive", "one"]).expect_success();
    assert_eq!((list(&[]), list(&["--all"])), (0, 1));
    coordinator.swarmctl(&["delete", "one"]).expect_success();
    assert_eq!(list(&["--all"]), 0);
    assert_eq!(coordinator.swarmctl(&["get", "one"]).code, Some(3));
}

#[test]
fn workers_end_by_themselves_when_they_are_idle_and_before_their_time_is_up() {
    let coordinator = CoordinatorProcess::start();
    let url = coordinator.url();
    let mut idle = WorkerProcess::start_with(&url, "idle", &["--idle-timeout", "1s"]);
    assert!(idle.process.wait().success());
    let reason = |worker: &WorkerProcess| {
        let message = "worker ends by itself";
        let line = worker.process.wait_for(message, |line| line["message"] == message);
        line["reason"].as_str().unwrap().to_owned()
    };
    assert_eq!(reason(&idle), "idle for the time of --idle-timeout");

    let experiment = Experiment::small(1000);
    let id = coordinator.submit(&experiment.path());
    let args = ["--idle-timeout", "1h", "--time-limit", "4s"];
    let mut limited = WorkerProcess::start_with(&url, "limited", &args);
    assert!(limited.process.wait().success());
    assert_eq!(reason(&limited), "near the end of --time-limit");
    let left = |line: &Value| line["message"] == "worker left" && line["name"] == "limited";
    coordinator.process.wait_for("the farewell", left);
    coordinator.swarmctl(&["cancel", &id.to_string()]).expect_success();
}

//! Coordinators that are killed, frozen and told to stop.

use std::{thread, time::Duration};

use harness::{CoordinatorProcess, LogLine, WorkerProcess};

use super::{GENERATIONS, MANY, SMALL, n_lost, resumed_at, wait_for_assignment};

#[test]
fn a_coordinator_killed_within_a_generation_evaluates_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = MANY.submit(&coordinator);
    let watch = coordinator.watch(id);

    // These are later assignments than the first ones: some results have arrived, others are
    // outstanding.
    let (n_seen, _) = wait_for_assignment(&coordinator, 3);
    let is_later = |line: &LogLine| line["message"] == "items assigned" && line["generation"] == 3;
    let (n_seen, _) = coordinator.process.find(n_seen, "second assignment", is_later);
    coordinator.process.find(n_seen, "third assignment", is_later);
    coordinator.process.kill();
    let is_evaluated = |line: &LogLine| {
        line["message"] == "batch evaluated"
            && line["generation"] == 3
            && line["trials"] == "selection"
    };
    assert!(!coordinator.process.lines().iter().any(is_evaluated), "the kill came within it");

    coordinator.restart();
    // It may also continue at the previous generation, whose commit may have been in progress.
    assert!((2..=3).contains(&resumed_at(&coordinator)));
    // The workers and the watching client have reconnected by themselves.
    MANY.assert_undisturbed(watch);
}

#[test]
fn a_coordinator_killed_while_it_commits_a_generation_evaluates_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    coordinator.wait_for_generation(1);

    // Holding the database's write lock keeps the coordinator between two generations: all
    // evaluated, nothing in flight, nothing committed.
    let database = coordinator.database();
    database.busy_timeout(Duration::from_secs(60)).unwrap();
    database.execute_batch("BEGIN IMMEDIATE").unwrap();
    let committed: u64 = database
        .query_row("SELECT max(generation) FROM generations", [], |row| row.get::<_, i64>(0))
        .unwrap()
        .unsigned_abs();
    let next = committed + 1;
    coordinator.process.wait_for("evaluated batch", |line| {
        line["message"] == "batch evaluated"
            && line["generation"] == next
            && line["trials"] == "selection"
    });
    coordinator.process.kill();
    database.execute_batch("ROLLBACK").unwrap();
    drop(database);
    assert!(next < GENERATIONS, "the experiment was not over");

    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), next);
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_coordinator_killed_after_a_commit_does_not_evaluate_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    coordinator.wait_for_generation(2);
    coordinator.process.kill();
    coordinator.restart();
    assert!(resumed_at(&coordinator) >= 3);
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_coordinator_told_to_stop_goes_on_later() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    wait_for_assignment(&coordinator, 2);
    coordinator.process.signal("TERM");
    assert_eq!(coordinator.process.wait().code(), Some(0));
    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 2);
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn eight_workers_come_back_by_themselves_to_a_killed_coordinator() {
    let mut coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 8);
    for worker in &workers {
        coordinator.process.wait_for("worker", |line| line["name"] == *worker.name);
    }
    let id = SMALL.submit(&coordinator);
    let watch = coordinator.watch(id);
    wait_for_assignment(&coordinator, 2);
    coordinator.process.kill();
    for worker in &workers {
        let is_loss = |line: &LogLine| {
            line["message"].as_str().is_some_and(|text| text.starts_with("connection lost"))
        };
        worker.process.wait_for("broken connection", is_loss);
    }

    coordinator.restart();
    // Generation 1 may not have been stored yet when generation 2 was assigned.
    assert!(resumed_at(&coordinator) >= 1);
    for worker in &workers {
        coordinator.process.wait_for("return", |line| {
            line["message"] == "worker joined" && line["name"] == *worker.name
        });
    }
    SMALL.assert_undisturbed(watch);
}

#[test]
fn a_frozen_coordinator_does_not_blame_its_workers() {
    let coordinator = CoordinatorProcess::start_with(&["--lease", "2"]);
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    wait_for_assignment(&coordinator, 1);
    coordinator.process.signal("STOP");
    // This pause is the fault itself, not a way of waiting.
    thread::sleep(Duration::from_millis(2500));
    coordinator.process.signal("CONT");
    SMALL.assert_undisturbed(coordinator.watch(id));
    assert_eq!(n_lost(&coordinator), 0);
}

//! Kills at any instant cost time, and not a bit of the result.
//!
//! Every test asserts that its kill hit what it was aimed at, and that the
//! digests of all generations equal those of an undisturbed run.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{sync::OnceLock, time::Duration};

use harness::{CoordinatorProcess, Experiment, LogLine, WorkerProcess};

const GENERATIONS: u64 = 6;

/// The digests of an undisturbed run.
fn undisturbed() -> &'static [String] {
    static DIGESTS: OnceLock<Vec<String>> = OnceLock::new();
    DIGESTS.get_or_init(|| {
        let coordinator = CoordinatorProcess::start();
        let _workers = WorkerProcess::start_many(&coordinator, 2);
        let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
        coordinator.watch(id).finish().0
    })
}

/// Waits until some worker has been given items of a generation; returns its
/// index and the number of lines of the coordinator's log up to there.
fn wait_for_assignment(coordinator: &CoordinatorProcess, generation: u64) -> (usize, LogLine) {
    coordinator.process.find(0, "assignment", |line| {
        line["message"] == "items assigned" && line["generation"] == generation
    })
}

/// The generation at which a restarted coordinator went on.
fn resumed_at(coordinator: &CoordinatorProcess) -> u64 {
    let line = coordinator
        .process
        .wait_for("start of the experiment", |line| line["message"] == "experiment starts");
    line["generation"].as_u64().unwrap()
}

#[test]
fn a_worker_killed_within_a_generation_costs_nothing_but_time() {
    let coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 3);
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());

    // It has just been given items that take it tens of milliseconds.
    let (_, assigned) = wait_for_assignment(&coordinator, 2);
    let joined = coordinator.process.wait_for("that worker's name", |line| {
        line["message"] == "worker joined" && line["worker"] == assigned["worker"]
    });
    let victim = workers.iter_mut().find(|worker| joined["name"] == *worker.name).unwrap();
    victim.process.kill();
    let lost = coordinator.process.wait_for("loss", |line| line["message"] == "worker lost");
    assert_eq!(lost["worker"], assigned["worker"]);
    assert!(lost["items_requeued"].as_u64().unwrap() > 0, "the kill hit work in flight: {lost}");

    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn workers_may_be_replaced_one_after_the_other() {
    let coordinator = CoordinatorProcess::start();
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    for generation in 0..GENERATIONS / 2 {
        let mut worker = WorkerProcess::start(&coordinator, &format!("short-lived-{generation}"));
        wait_for_assignment(&coordinator, 2 * generation + 1);
        worker.process.kill();
    }
    let _worker = WorkerProcess::start(&coordinator, "last");
    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn a_coordinator_killed_within_a_generation_judges_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    let watch = coordinator.watch(id);

    // More assignments than the first ones: results have come in, others are
    // out.
    let (n_seen, _) = wait_for_assignment(&coordinator, 3);
    let is_later = |line: &LogLine| line["message"] == "items assigned" && line["generation"] == 3;
    let (n_seen, _) = coordinator.process.find(n_seen, "second assignment", is_later);
    coordinator.process.find(n_seen, "third assignment", is_later);
    coordinator.process.kill();
    let is_judged =
        |line: &LogLine| line["message"] == "generation judged" && line["generation"] == 3;
    assert!(!coordinator.process.lines().iter().any(is_judged), "the kill came within it");

    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 3);
    // The workers and the watching client have come back by themselves.
    let (digests, _) = watch.finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn a_coordinator_killed_while_it_commits_a_generation_judges_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    coordinator.wait_for_generation(1);

    // Whoever holds the database's write lock keeps the coordinator between two
    // generations: all judged, nothing in flight, nothing committed.
    let database = coordinator.database();
    database.busy_timeout(Duration::from_secs(60)).unwrap();
    database.execute_batch("BEGIN IMMEDIATE").unwrap();
    let committed: u64 = database
        .query_row("SELECT max(generation) FROM generations", [], |row| row.get::<_, i64>(0))
        .unwrap()
        .unsigned_abs();
    let next = committed + 1;
    coordinator.process.wait_for("judged generation", |line| {
        line["message"] == "generation judged" && line["generation"] == next
    });
    coordinator.process.kill();
    database.execute_batch("ROLLBACK").unwrap();
    drop(database);
    assert!(next < GENERATIONS, "the experiment was not over");

    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), next);
    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn a_coordinator_killed_after_a_commit_does_not_judge_it_again() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    coordinator.wait_for_generation(2);
    coordinator.process.kill();
    coordinator.restart();
    assert!(resumed_at(&coordinator) >= 3);
    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn a_worker_told_to_stop_finishes_its_item_and_leaves() {
    let coordinator = CoordinatorProcess::start();
    let mut worker = WorkerProcess::start(&coordinator, "polite");
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    // The second assignment answers a result: the worker is at work.
    let (n_seen, _) = wait_for_assignment(&coordinator, 0);
    coordinator.process.find(n_seen, "another assignment", |l| l["message"] == "items assigned");
    worker.process.signal("TERM");
    assert_eq!(worker.process.wait().code(), Some(0));
    let left = coordinator.process.wait_for("farewell", |line| line["message"] == "worker left");
    assert_eq!(left["name"], "polite");

    let _worker = WorkerProcess::start(&coordinator, "next");
    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

#[test]
fn a_coordinator_told_to_stop_goes_on_later() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    wait_for_assignment(&coordinator, 2);
    coordinator.process.signal("TERM");
    assert_eq!(coordinator.process.wait().code(), Some(0));
    coordinator.restart();
    assert_eq!(resumed_at(&coordinator), 2);
    let (digests, _) = coordinator.watch(id).finish();
    assert_eq!(digests, undisturbed());
}

//! Workers that are killed, frozen, replaced and told to stop.

use harness::{CoordinatorProcess, WorkerProcess};

use super::{GENERATIONS, SMALL, wait_for_assignment, wait_for_loss};

#[test]
fn a_worker_killed_within_a_generation_costs_nothing_but_time() {
    let coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 3);
    let id = SMALL.submit(&coordinator);

    // The worker has just got items that take tens of milliseconds.
    let (_, assigned) = wait_for_assignment(&coordinator, 2);
    let joined = coordinator.process.wait_for("that worker's name", |line| {
        line["message"] == "worker joined" && line["worker"] == assigned["worker"]
    });
    let victim = workers.iter_mut().find(|worker| joined["name"] == *worker.name).unwrap();
    victim.process.kill();
    let lost = coordinator.process.wait_for("loss", |line| line["message"] == "worker lost");
    assert_eq!(lost["worker"], assigned["worker"]);
    assert!(lost["items_requeued"].as_u64().unwrap() > 0, "the kill hit work in flight: {lost}");

    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn workers_may_be_replaced_one_after_the_other() {
    let coordinator = CoordinatorProcess::start();
    let id = SMALL.submit(&coordinator);
    for generation in 0..GENERATIONS / 2 {
        let mut worker = WorkerProcess::start(&coordinator, &format!("short-lived-{generation}"));
        wait_for_assignment(&coordinator, 2 * generation + 1);
        worker.process.kill();
    }
    let _worker = WorkerProcess::start(&coordinator, "last");
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_worker_told_to_stop_finishes_its_item_and_leaves() {
    let coordinator = CoordinatorProcess::start();
    let mut worker = WorkerProcess::start(&coordinator, "polite");
    let id = SMALL.submit(&coordinator);
    // The second assignment answers a result: the worker is at work.
    let (n_seen, _) = wait_for_assignment(&coordinator, 0);
    coordinator.process.find(n_seen, "another assignment", |l| l["message"] == "items assigned");
    worker.process.signal("TERM");
    assert_eq!(worker.process.wait().code(), Some(0));
    let left = coordinator
        .process
        .wait_for("end of the worker's stream", |line| line["message"] == "worker left");
    assert_eq!(left["name"], "polite");

    let _worker = WorkerProcess::start(&coordinator, "next");
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_worker_frozen_for_longer_than_its_lease_comes_back() {
    let coordinator = CoordinatorProcess::start_with(&["--lease", "1"]);
    let worker = WorkerProcess::start(&coordinator, "sleeper");
    let id = SMALL.submit(&coordinator);
    wait_for_assignment(&coordinator, 1);
    worker.process.signal("STOP");
    let lost = wait_for_loss(&coordinator);
    assert_eq!(lost["reason"], "silent for 1 s");
    assert!(lost["items_requeued"].as_u64().unwrap() > 0, "it had work: {lost}");

    // After thawing, it delivers late results, learns that it was dropped, and reconnects.
    worker.process.signal("CONT");
    coordinator.process.wait_for("return", |line| {
        line["message"] == "worker joined" && line["worker"] != lost["worker"]
    });
    SMALL.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_frozen_worker_is_not_missed_by_the_others() {
    let coordinator = CoordinatorProcess::start_with(&["--lease", "1"]);
    let sleeper = WorkerProcess::start(&coordinator, "sleeper");
    let id = SMALL.submit(&coordinator);
    wait_for_assignment(&coordinator, 1);
    sleeper.process.signal("STOP");
    let _other = WorkerProcess::start(&coordinator, "awake");
    // The experiment ends while one of its workers is frozen.
    SMALL.assert_undisturbed(coordinator.watch(id));
    assert_eq!(wait_for_loss(&coordinator)["name"], "sleeper");
}

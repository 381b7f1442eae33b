//! Disks that are full or read-only, and databases that refuse a write permanently.

use harness::{CoordinatorProcess, LogLine, SmallDisk, WorkerProcess, run_coordinator, skipped};

use super::{OTHER, TINY, wait_for_assignment};

/// A disk that the test can fill; without the privilege to mount one, the test is skipped.
fn small_disk() -> Option<SmallDisk> {
    let disk = SmallDisk::mount(2 << 20);
    if disk.is_none() {
        skipped("this process may not mount a file system");
    }
    disk
}

fn message_contains(line: &LogLine, text: &str) -> bool {
    line["message"].as_str().is_some_and(|message| message.contains(text))
}

#[test]
fn on_a_full_disk_an_experiment_waits_and_goes_on_by_itself() {
    let Some(disk) = small_disk() else { return };
    let coordinator = CoordinatorProcess::start_in(disk.path());
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    wait_for_assignment(&coordinator, 1);
    disk.fill();
    let waits = |line: &LogLine| {
        message_contains(line, &format!("of experiment {id} waits"))
            && message_contains(line, "disk is full")
    };
    let (n_seen, _) = coordinator.process.find(0, "complaint", waits);
    coordinator.process.find(n_seen, "second attempt", waits);

    // A client that submits now gets the reason, and not the error of an absent coordinator.
    let refused = coordinator.swarmctl(&["submit", (TINY.make)().path().to_str().unwrap()]);
    assert_eq!(refused.code, Some(2), "{refused:#?}");
    assert!(refused.stderr.contains("disk is full"), "{}", refused.stderr);
    assert!(!refused.stderr.contains("cannot reach"), "{}", refused.stderr);
    // Commands that only read still work.
    let list = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(list.as_array().unwrap().len(), 1);
    assert_eq!(list[0]["state"], "running");

    // `explain` says why.
    let explain = ["explain", &id.to_string()];
    let explained = coordinator.swarmctl(&explain).expect_success().json();
    assert_eq!(explained["findings"][0]["kind"], "store_trouble", "{explained}");
    let what = explained["findings"][0]["what"].as_str().unwrap();
    assert!(what.contains("disk is full"), "{what}");

    disk.make_room();
    coordinator.process.wait_for("relief", |line| message_contains(line, "takes writes again"));
    TINY.assert_undisturbed(coordinator.watch(id));
    drop((workers, coordinator));
}

#[test]
fn a_coordinator_killed_on_a_full_disk_loses_nothing() {
    let Some(disk) = small_disk() else { return };
    let mut coordinator = CoordinatorProcess::start_in(disk.path());
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    let watch = coordinator.watch(id);
    wait_for_assignment(&coordinator, 1);
    disk.fill();
    coordinator.process.wait_for("complaint", |line| message_contains(line, "disk is full"));
    coordinator.process.kill();
    disk.make_room();
    coordinator.restart();
    TINY.assert_undisturbed(watch);
    drop((workers, coordinator));
}

#[test]
fn a_read_only_data_directory_is_one_clear_line() {
    let Some(disk) = small_disk() else { return };
    drop(CoordinatorProcess::start_in(disk.path()));
    disk.set_read_only(true);
    let outcome = run_coordinator("127.0.0.1:0", disk.path());
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("Read-only"), "{}", outcome.stderr);
    disk.set_read_only(false);
    drop(CoordinatorProcess::start_in(disk.path()));
}

#[test]
fn a_commit_that_can_never_succeed_fails_its_experiment_and_no_other() {
    let coordinator = CoordinatorProcess::start();
    let doomed = TINY.submit(&coordinator);
    coordinator
        .database()
        .execute_batch(&format!(
            "CREATE TRIGGER refusal BEFORE INSERT ON generations
             WHEN NEW.experiment_id = {doomed} AND NEW.generation = 2
             BEGIN SELECT raise(ABORT, 'as the test wants it'); END"
        ))
        .unwrap();
    let sound = OTHER.submit(&coordinator);
    let _workers = WorkerProcess::start_many(&coordinator, 2);

    let (code, finished) = coordinator.watch(doomed).end();
    assert_eq!(code, Some(5));
    assert_eq!(finished.last["state"], "failed");
    let reason = finished.last["reason"].as_str().unwrap();
    assert!(reason.contains("as the test wants it"), "{reason}");
    assert_eq!(finished.generations.len(), 2, "complete generations stay");
    OTHER.assert_undisturbed(coordinator.watch(sound));
}

#[test]
fn an_end_that_cannot_be_stored_is_stored_once_it_can() {
    let coordinator = CoordinatorProcess::start();
    let id = TINY.submit(&coordinator);
    let database = coordinator.database();
    database
        .execute_batch(
            "CREATE TRIGGER refusal BEFORE UPDATE OF state ON experiments
             BEGIN SELECT raise(ABORT, 'as the test wants it'); END",
        )
        .unwrap();
    // Its client does not wait for long, and does not get the error of an absent coordinator.
    let cancelled = coordinator.swarmctl(&["cancel", &id.to_string()]);
    assert_eq!(cancelled.code, Some(2), "{cancelled:#?}");
    assert!(cancelled.stderr.contains("did not store the change"), "{}", cancelled.stderr);
    let waits = format!("the end of experiment {id} waits");
    coordinator.process.wait_for("complaint", |line| message_contains(line, &waits));
    let list = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(list[0]["state"], "running", "a list shows the end only once it is stored");

    database.execute_batch("DROP TRIGGER refusal").unwrap();
    coordinator.process.wait_for("relief", |line| message_contains(line, "takes writes again"));
    let list = coordinator.swarmctl(&["list"]).expect_success().json();
    assert_eq!(list[0]["state"], "cancelled");
}

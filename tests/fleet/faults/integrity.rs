//! Data directories that another program edits, or uses at the same time.

use std::fs;

use harness::{CoordinatorProcess, LogLine, WorkerProcess, run_coordinator};
use rusqlite::{Connection, params};

use super::{OTHER, TINY};

/// Waits until an experiment is paused because it is damaged; returns the reason.
fn wait_for_pause(coordinator: &CoordinatorProcess) -> String {
    let is_pause =
        |line: &LogLine| line["message"] == "experiment paused" && line["level"] == "ERROR";
    let line = coordinator.process.wait_for("pause", is_pause);
    line["reason"].as_str().unwrap().to_owned()
}

/// Edits a stopped coordinator's database and starts the coordinator again.
fn edit_and_restart(coordinator: &mut CoordinatorProcess, edit: impl FnOnce(&Connection)) {
    coordinator.process.kill();
    edit(&coordinator.database());
    coordinator.restart();
}

#[test]
fn an_experiment_whose_configuration_was_edited_waits_for_a_person_and_the_others_go_on() {
    let mut coordinator = CoordinatorProcess::start();
    let edited = TINY.submit(&coordinator);
    let sound = OTHER.submit(&coordinator);
    let read = "SELECT config FROM configs WHERE experiment_id = ?1";
    let write = "UPDATE configs SET config = ?2 WHERE experiment_id = ?1";
    let original: String =
        coordinator.database().query_row(read, [edited], |row| row.get(0)).unwrap();
    // Changes only the seed.
    let changed = original.replace("\"seed\":7", "\"seed\":6");
    assert_ne!(changed, original);
    edit_and_restart(&mut coordinator, |database| {
        database.execute(write, params![edited, changed]).unwrap();
    });

    let reason = wait_for_pause(&coordinator);
    for part in ["its configuration is not what was stored", "swarmctl doctor --data-dir"] {
        assert!(reason.contains(part), "{reason}");
    }
    assert!(reason.contains(&format!("experiment {edited} ")), "{reason}");
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    OTHER.assert_undisturbed(coordinator.watch(sound));
    let id = edited.to_string();
    let explained = coordinator.swarmctl(&["explain", &id]).expect_success().json();
    assert_eq!(explained["experiment"]["state"], "paused");
    assert_eq!(explained["experiment"]["reason"], reason.as_str());
    assert_eq!(explained["experiment"]["generations_done"], 0);
    let refused = coordinator.swarmctl(&["resume", &id]);
    assert_eq!(refused.code, Some(3), "{refused:#?}");
    assert!(refused.stderr.contains("its configuration is not"), "{}", refused.stderr);

    // Once the row is restored, the experiment continues, even without a restart.
    coordinator.database().execute(write, params![edited, original]).unwrap();
    coordinator.swarmctl(&["resume", &id]).expect_success();
    TINY.assert_undisturbed(coordinator.watch(edited));
}

#[test]
fn an_experiment_whose_checkpoint_was_edited_does_not_come_to_another_digest() {
    let mut coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 1);
    let id = TINY.submit(&coordinator);
    coordinator.wait_for_generation(1);
    edit_and_restart(&mut coordinator, |database| {
        // Changes a bit of a number. The evolution is still valid.
        let read = "SELECT state FROM keyframes";
        let mut state: Vec<u8> = database.query_row(read, [], |row| row.get(0)).unwrap();
        state[40] ^= 1;
        let n_changed = database.execute("UPDATE keyframes SET state = ?1", [state]).unwrap();
        assert_eq!(n_changed, 1);
    });
    let reason = wait_for_pause(&coordinator);
    assert!(reason.contains("its checkpoint"), "{reason}");
    let n_committed = coordinator.n_committed(id);
    // The next start reports the same damage, and changes nothing.
    coordinator.process.kill();
    coordinator.restart();
    assert_eq!(wait_for_pause(&coordinator), reason);
    assert_eq!(coordinator.n_committed(id), n_committed);
    drop(workers);
}

#[test]
fn a_deleted_lock_file_does_not_let_a_second_coordinator_in() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = TINY.submit(&coordinator);
    coordinator.wait_for_generation(0);
    fs::remove_file(coordinator.data_dir().join("swarmevo.lock")).unwrap();
    let second = run_coordinator("127.0.0.1:0", coordinator.data_dir());
    assert_eq!(second.code, Some(2), "{second:#?}");
    assert_eq!(second.stderr.lines().count(), 1, "{}", second.stderr);
    assert!(second.stderr.contains("in use by another coordinator"), "{}", second.stderr);
    TINY.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_coordinator_that_loses_its_database_to_another_stops_and_fails_nothing() {
    let mut coordinator = CoordinatorProcess::start();
    let id = TINY.submit(&coordinator);
    // The first step of a coordinator on another machine, whose locks do not reach this one.
    let claim = "UPDATE identity SET owner = randomblob(16)";
    coordinator.database().execute(claim, []).unwrap();
    // With workers from the beginning, the experiment could end before.
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    assert_eq!(coordinator.process.wait().code(), Some(3));
    let lines = coordinator.process.lines();
    let last = lines.last().unwrap();
    assert_eq!(last["level"], "ERROR");
    assert!(last["message"].as_str().unwrap().contains("has taken over"), "{last}");
    assert_eq!(lines.iter().filter(|line| line["level"] == "ERROR").count(), 1, "{lines:#?}");
    let state: String = coordinator
        .database()
        .query_row("SELECT state FROM experiments", [], |row| row.get(0))
        .unwrap();
    assert_eq!(state, "running");

    coordinator.restart();
    TINY.assert_undisturbed(coordinator.watch(id));
}

#[test]
fn a_coordinator_whose_database_breaks_stops_and_fails_nothing() {
    let mut coordinator = CoordinatorProcess::start();
    let id = TINY.submit(&coordinator);
    // Makes the table of events point to a page that does not exist.
    let database = coordinator.database();
    let root = "SELECT rootpage FROM sqlite_schema WHERE name = 'events'";
    let sound: u64 = database.query_row(root, [], |row| row.get(0)).unwrap();
    let version: u64 = database.query_row("PRAGMA schema_version", [], |row| row.get(0)).unwrap();
    let move_to = |database: &Connection, page: u64, version: u64| {
        let sql = format!(
            "PRAGMA writable_schema = ON;
             UPDATE sqlite_schema SET rootpage = {page} WHERE name = 'events';
             PRAGMA schema_version = {version};"
        );
        database.execute_batch(&sql).unwrap();
    };
    move_to(&database, 1 << 30, version + 1);
    // With workers from the beginning, the experiment could end before.
    let workers = WorkerProcess::start_many(&coordinator, 2);
    assert_eq!(coordinator.process.wait().code(), Some(2));
    let lines = coordinator.process.lines();
    let last = lines.last().unwrap()["message"].as_str().unwrap();
    assert!(last.starts_with("the database is damaged: "), "{last}");
    assert!(last.contains("swarmevo.sqlite3") && last.contains("swarmctl doctor"), "{last}");
    assert!(!lines.iter().any(|line| line["message"] == "experiment failed"), "{lines:#?}");

    move_to(&database, sound, version + 2);
    drop(database);
    coordinator.restart();
    TINY.assert_undisturbed(coordinator.watch(id));
    drop(workers);
}

//! Data directories that are copied, damaged and recovered with `swarmctl`.

use std::{fs, path::Path};

use harness::{CoordinatorProcess, Outcome, WorkerProcess, run_coordinator, swarmctl};
use serde_json::Value;

use super::{OTHER, SMALL, TINY, resumed_at};

const DATABASE: &str = "swarmevo.sqlite3";
const PAGE: usize = 4096;

/// Runs `swarmctl COMMAND --data-dir DIRECTORY ARGS`.
fn on(directory: &Path, command: &str, args: &[&Path]) -> Outcome {
    let options = [Path::new(command), Path::new("--data-dir"), directory];
    swarmctl(options.iter().chain(args))
}

fn recover(directory: &Path, to: &Path) -> Value {
    on(directory, "doctor", &[Path::new("--recover"), to]).expect_success().json()
}

/// Kills a coordinator, and moves all data into its main file.
fn stop(coordinator: &mut CoordinatorProcess) -> Vec<u8> {
    coordinator.process.kill();
    let database = coordinator.database();
    database.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)").unwrap();
    drop(database);
    fs::read(coordinator.data_dir().join(DATABASE)).unwrap()
}

#[test]
fn a_backup_of_a_running_experiment_continues_elsewhere_to_the_same_bits() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    coordinator.wait_for_generation(1);
    let directory = tempfile::tempdir().unwrap();
    let to = directory.path().join("backups").join("today");
    let made = on(coordinator.data_dir(), "backup", &[&to]).expect_success().json();
    assert_eq!(made["findings"], Value::Array(vec![]));
    let n_copied = made["generations"].as_u64().unwrap();
    assert!((2..6).contains(&n_copied), "in the middle of the run: {made}");
    let names = fs::read_dir(&to).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(names.collect::<Vec<_>>(), [DATABASE], "the copy is one file");
    // The original continues after the backup, and is then lost.
    coordinator.wait_for_generation(n_copied);
    coordinator.process.kill();

    let restored = CoordinatorProcess::start_in(&to);
    assert_eq!(resumed_at(&restored), n_copied);
    let _workers = WorkerProcess::start_many(&restored, 2);
    SMALL.assert_undisturbed(restored.watch(id));
    // Another target is refused while this one exists.
    let again = on(coordinator.data_dir(), "backup", &[&to]);
    assert_eq!(again.code, Some(2), "{again:#?}");
    assert!(again.stderr.contains("exists already; choose another name"), "{}", again.stderr);
}

#[test]
fn a_copy_of_a_database_in_use_without_its_log_is_refused() {
    let mut coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let id = SMALL.submit(&coordinator);
    coordinator.wait_for_generation(0);
    // After a restart, the main file has data.
    coordinator.process.signal("TERM");
    assert_eq!(coordinator.process.wait().code(), Some(0));
    coordinator.restart();
    let n_before = resumed_at(&coordinator);
    coordinator.wait_for_generation(n_before + 1);
    let copied = tempfile::tempdir().unwrap();
    fs::copy(coordinator.data_dir().join(DATABASE), copied.path().join(DATABASE)).unwrap();
    drop((workers, coordinator));

    let refused = run_coordinator("127.0.0.1:0", copied.path());
    assert_eq!(refused.code, Some(2), "{refused:#?}");
    assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    for part in ["without its write-ahead log", "swarmctl backup", "--recover"] {
        assert!(refused.stderr.contains(part), "{}", refused.stderr);
    }
    let backup = on(copied.path(), "backup", &[&copied.path().join("backup")]);
    assert_eq!(backup.code, Some(11), "{backup:#?}");
    let found = on(copied.path(), "doctor", &[]);
    assert_eq!(found.code, Some(11), "{found:#?}");
    let to = copied.path().join("new");
    recover(copied.path(), &to);
    let restored = CoordinatorProcess::start_in(&to);
    assert_eq!(resumed_at(&restored), n_before, "the latest generations were in the log");
    let _workers = WorkerProcess::start_many(&restored, 2);
    SMALL.assert_undisturbed(restored.watch(id));
}

/// Damages a database with a completed and a running experiment, and recovers it. Every experiment
/// that is not lost ends with the digest of an undisturbed run.
fn is_recovered(damage: impl FnOnce(&mut Vec<u8>)) {
    let mut coordinator = CoordinatorProcess::start();
    let workers = WorkerProcess::start_many(&coordinator, 2);
    let completed = OTHER.submit(&coordinator);
    OTHER.assert_undisturbed(coordinator.watch(completed));
    let running = TINY.submit(&coordinator);
    let name = running.to_string();
    coordinator.process.wait_for("generation", |line| {
        line["message"] == "generation"
            && line["experiment"] == name.as_str()
            && line["generation"] == 2
    });
    let mut bytes = stop(&mut coordinator);
    drop(workers);
    damage(&mut bytes);
    let damaged = tempfile::tempdir().unwrap();
    fs::write(damaged.path().join(DATABASE), &bytes).unwrap();

    let refused = run_coordinator("127.0.0.1:0", damaged.path());
    assert_eq!(refused.code, Some(2), "{refused:#?}");
    assert_eq!(refused.stderr.lines().count(), 1, "{}", refused.stderr);
    for part in ["the database is damaged", DATABASE, "swarmctl doctor"] {
        assert!(refused.stderr.contains(part), "{}", refused.stderr);
    }
    let found = on(damaged.path(), "doctor", &[]);
    assert_eq!(found.code, Some(11), "{found:#?}");
    let document = found.json();
    let findings = document["findings"].as_array().unwrap();
    assert!(!findings.is_empty());
    for finding in findings {
        assert!(finding["next_step"].as_str().unwrap().contains("--recover NEW"), "{finding}");
    }

    let to = damaged.path().join("new");
    let recovery = recover(damaged.path(), &to);
    assert!(fs::read(damaged.path().join(DATABASE)).unwrap() == bytes, "it is not written to");
    let restored = CoordinatorProcess::start_in(&to);
    let _workers = WorkerProcess::start_many(&restored, 2);
    let experiments = recovery["experiments"].as_array().unwrap();
    let mut n_left = 0;
    for (id, subject) in [(completed, &OTHER), (running, &TINY)] {
        let outcome = experiments.iter().find(|found| found["id"] == id);
        match outcome.map(|found| found["outcome"].as_str().unwrap()) {
            Some("lost") | None => continue,
            Some("restarted") => {
                restored.swarmctl(&["resume", &id.to_string()]).expect_success();
            }
            Some(_) => {}
        }
        subject.assert_undisturbed(restored.watch(id));
        n_left += 1;
    }
    assert!(n_left > 0, "{recovery:#}");
}

#[test]
fn a_database_with_a_damaged_page_is_recovered() {
    is_recovered(|bytes| {
        // A page through which SQLite finds the whole history.
        let page = root_page(bytes, "generations");
        bytes[(page - 1) * PAGE..page * PAGE].fill(0xa5);
    });
}

/// Number, from 1, of the first page of a table.
fn root_page(database: &[u8], table: &str) -> usize {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), database).unwrap();
    let database = rusqlite::Connection::open(file.path()).unwrap();
    let sql = "SELECT rootpage FROM sqlite_schema WHERE name = ?1";
    database.query_row(sql, [table], |row| row.get(0)).unwrap()
}

#[test]
fn a_truncated_database_is_recovered() {
    is_recovered(|bytes| bytes.truncate(bytes.len() * 9 / 10));
}

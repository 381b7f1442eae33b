//! Databases that must not be used: the coordinator refuses them with one line, and leaves them
//! alone.

use std::{
    collections::BTreeMap,
    fs,
    io::{Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
};

use harness::{CoordinatorProcess, WorkerProcess, run_coordinator, swarmctl};
use rusqlite::Connection;
use tempfile::TempDir;

use super::TINY;

const DATABASE: &str = "swarmevo.sqlite3";

/// A data directory with a finished experiment.
fn data_directory() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let mut coordinator = CoordinatorProcess::start_in(directory.path());
    let _worker = WorkerProcess::start(&coordinator, "worker");
    let id = TINY.submit(&coordinator);
    TINY.assert_undisturbed(coordinator.watch(id));
    coordinator.process.kill();
    // Moves everything into the main file.
    let database = Connection::open(directory.path().join(DATABASE)).unwrap();
    database.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)").unwrap();
    directory
}

/// The files with data, without the lock and the shared memory.
fn contents(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    let has_data =
        |path: &PathBuf| path.extension().is_some_and(|e| e != "lock" && e != "sqlite3-shm");
    paths.filter(has_data).map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

fn assert_refused(directory: &Path, what: &str, expected: &[&str]) {
    let before = contents(directory);
    assert!(before.contains_key(&directory.join(DATABASE)));
    let outcome = run_coordinator("127.0.0.1:0", directory);
    assert_eq!(outcome.code, Some(2), "{what}: {outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{what}: {}", outcome.stderr);
    for expected in expected {
        assert!(outcome.stderr.contains(expected), "{what}: {}", outcome.stderr);
    }
    for (path, bytes) in before {
        assert!(fs::read(&path).unwrap() == bytes, "{what}: {} has changed", path.display());
    }
}

#[test]
fn a_damaged_database_is_refused_untouched() {
    let sound = data_directory();
    let sound = fs::read(sound.path().join(DATABASE)).unwrap();
    let (middle, page) = (sound.len() / 2, 4096);
    assert!(sound.len() >= 8 * page);
    let mut scribbled = sound.clone();
    scribbled[page..sound.len() - page].fill(0xa5);
    let mut headless = sound.clone();
    headless[..16].fill(0);
    for (what, bytes) in [
        ("truncated", sound[..middle / page * page].to_vec()),
        ("truncated within a page", sound[..middle + 77].to_vec()),
        ("truncated within its header", sound[..50].to_vec()),
        ("emptied", Vec::new()),
        ("scribbled on", scribbled),
        ("without its header", headless),
        ("something else", b"not a database, but long enough".repeat(99)),
    ] {
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join(DATABASE), bytes).unwrap();
        assert_refused(
            directory.path(),
            what,
            &["the database is damaged", DATABASE, "restore it from a copy"],
        );
    }
}

#[test]
fn a_database_of_a_newer_version_is_refused_untouched() {
    let directory = data_directory();
    let database = Connection::open(directory.path().join(DATABASE)).unwrap();
    // The database's log, which is not in the main file yet, must also stay.
    database.pragma_update(None, "wal_autocheckpoint", 0).unwrap();
    database.pragma_update(None, "user_version", 1000).unwrap();
    let copy = tempfile::tempdir().unwrap();
    for path in contents(directory.path()).keys() {
        fs::copy(path, copy.path().join(path.file_name().unwrap())).unwrap();
    }
    assert!(fs::metadata(copy.path().join("swarmevo.sqlite3-wal")).unwrap().len() > 0);
    assert_refused(copy.path(), "newer", &["version 1000", "use the newer program"]);

    let experiment = (TINY.make)();
    let (path, data_dir) = (experiment.path(), copy.path().to_str().unwrap());
    let outcome = swarmctl(["run", path.to_str().unwrap(), "--data-dir", data_dir]);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert!(outcome.stderr.contains("use the newer program"), "{}", outcome.stderr);
}

#[test]
fn a_database_of_another_program_is_refused_untouched() {
    let directory = tempfile::tempdir().unwrap();
    let database = Connection::open(directory.path().join(DATABASE)).unwrap();
    database.execute_batch("CREATE TABLE recipes (name TEXT)").unwrap();
    drop(database);
    assert_refused(directory.path(), "another program's", &["no tables of experiments"]);
}

#[test]
fn a_sound_database_is_used_whatever_is_beside_it() {
    let directory = data_directory();
    // The remains of a first start that was killed, and a stale lock file.
    fs::write(directory.path().join("swarmevo.sqlite3.new"), "half a datab").unwrap();
    let mut lock = fs::File::create(directory.path().join("swarmevo.lock")).unwrap();
    lock.seek(SeekFrom::Start(0)).unwrap();
    lock.write_all(b"1234").unwrap();
    drop(lock);
    let coordinator = CoordinatorProcess::start_in(directory.path());
    TINY.assert_undisturbed(coordinator.watch(1));
}

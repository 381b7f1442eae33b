//! The database's file: one coordinator at a time, created whole or not at all,
//! and never touched if it is not sound.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::Path,
    time::Duration,
};

use rusqlite::{Connection, OpenFlags};

use super::{Result, StoreError, schema};

const DATABASE_FILE: &str = "swarmevo.sqlite3";
/// What a database is called until its schema is complete.
const UNFINISHED_FILE: &str = "swarmevo.sqlite3.new";
const LOCK_FILE: &str = "swarmevo.lock";
/// How long an operation waits for another program that uses the database.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);

/// Opens, and if need be creates, the database in `directory`; the file is the
/// lock that keeps others out.
pub fn open(directory: &Path) -> Result<(Connection, File)> {
    let unusable = |source| StoreError::Directory { path: directory.to_owned(), source };
    fs::create_dir_all(directory).map_err(unusable)?;
    let lock = File::create(directory.join(LOCK_FILE)).map_err(unusable)?;
    lock.try_lock().map_err(|error| match error {
        TryLockError::WouldBlock => StoreError::Locked { path: directory.to_owned() },
        TryLockError::Error(source) => unusable(source),
    })?;
    let path = directory.join(DATABASE_FILE);
    if path.try_exists().map_err(unusable)? {
        check(&path)?;
    } else {
        create(directory, &path, unusable)?;
    }
    let mut connection = Connection::open(path)?;
    connection.busy_timeout(BUSY_TIMEOUT)?;
    connection.pragma_update(None, "journal_mode", "WAL")?;
    connection.pragma_update(None, "synchronous", "FULL")?;
    schema::migrate(&mut connection)?;
    Ok((connection, lock))
}

/// Creates an empty database. Under another name at first, so that an empty file
/// under the right one is damage, and not a coordinator killed at its first start.
fn create(directory: &Path, path: &Path, unusable: impl Fn(io::Error) -> StoreError) -> Result<()> {
    let unfinished = directory.join(UNFINISHED_FILE);
    match fs::remove_file(&unfinished) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(unusable(error)),
        _ => {}
    }
    let mut connection = Connection::open(&unfinished)?;
    schema::migrate(&mut connection)?;
    connection.close().map_err(|(_, error)| error)?;
    fs::rename(&unfinished, path).map_err(&unusable)?;
    File::open(directory).and_then(|directory| directory.sync_all()).map_err(unusable)
}

/// Refuses a database that this program must not write to. Read-only, so that
/// whoever repairs it finds every byte as it was.
fn check(path: &Path) -> Result<()> {
    let damaged =
        |what: &dyn std::fmt::Display| StoreError::Corrupt(format!("{}: {what}", path.display()));
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let verdict = Connection::open_with_flags(path, flags).and_then(|connection| {
        connection.busy_timeout(BUSY_TIMEOUT)?;
        let version = schema::version(&connection)?;
        let soundness: String =
            connection.query_row("PRAGMA quick_check(1)", [], |row| row.get(0))?;
        Ok((version, soundness))
    });
    match verdict.map_err(StoreError::from) {
        Ok((..=0, _)) => Err(damaged(&"it has no tables of experiments")),
        Ok((version, _)) if version > schema::VERSION => {
            Err(StoreError::Newer { found: version, supported: schema::VERSION })
        }
        Ok((_, soundness)) if soundness != "ok" => Err(damaged(&soundness.replace('\n', " "))),
        Ok(_) => Ok(()),
        Err(StoreError::Corrupt(what)) => Err(damaged(&what)),
        Err(error) => Err(error),
    }
}

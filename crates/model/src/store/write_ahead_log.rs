//! Makes the main file of a database in use tell that it lacks its write-ahead log.
//!
//! SQLite appends commits to a log beside the main file, and moves them there from time
//! to time. The main file alone is a sound database of an earlier moment, and a copy of
//! it passes for the whole. So here, what the main file says of itself is that it needs
//! its log, and the log says that it does not: the two together, moved into one file by
//! whatever program, are complete, and the main file without the log is found out.

use std::{
    fs,
    path::{Path, PathBuf},
};

use rusqlite::Connection;

/// Pages in the log at which it is moved into the main file, as many as by SQLite's default.
const N_PAGES_MAX: u32 = 1000;

/// Takes over the moving of the log from SQLite.
pub fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "wal_autocheckpoint", 0)
}

/// The log of a database.
pub fn path(database: &Path) -> PathBuf {
    let mut path = database.as_os_str().to_owned();
    path.push("-wal");
    path.into()
}

/// Whether a database has a log that says anything.
pub fn exists(database: &Path) -> bool {
    fs::metadata(path(database)).is_ok_and(|metadata| metadata.len() > 0)
}

/// Moves the log into the main file if it is long.
pub fn fold_if_long(connection: &Connection) -> rusqlite::Result<()> {
    let mut statement = connection.prepare_cached("PRAGMA wal_checkpoint(NOOP)")?;
    let n_pages: u32 = statement.query_row([], |row| row.get(1))?;
    if n_pages < N_PAGES_MAX { Ok(()) } else { fold(connection) }
}

/// Whether the database says that it lacks its log.
pub fn is_missed(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("SELECT needs_log FROM identity", [], |row| row.get(0))
}

/// Moves as much of the log into the main file as readers allow.
pub fn fold(connection: &Connection) -> rusqlite::Result<()> {
    set_missed(connection, true)?;
    // Never waits: what a reader still needs stays in the log.
    let folded = connection.query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |_| Ok(()));
    set_missed(connection, false)?;
    folded
}

/// What the database says from now on.
pub fn set_missed(connection: &Connection, is_missed: bool) -> rusqlite::Result<()> {
    connection.execute("UPDATE identity SET needs_log = ?1", [is_missed])?;
    Ok(())
}

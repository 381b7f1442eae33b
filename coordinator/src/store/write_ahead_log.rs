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

/// Length at which the log is moved into the main file.
const LEN_MAX: u64 = 16 << 20;

/// Takes over the moving of the log from SQLite.
pub fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "wal_autocheckpoint", 0)?;
    // A log that begins anew is as long as what is in it.
    connection.pragma_update(None, "journal_size_limit", 0)
}

/// The log of a database.
pub fn path(database: &Path) -> PathBuf {
    let mut path = database.as_os_str().to_owned();
    path.push("-wal");
    path.into()
}

/// Whether a database has a log that says anything.
pub fn exists(database: &Path) -> bool {
    len(database) > 0
}

/// Whether it is time to move the log into the main file.
pub fn is_long(database: &Path) -> bool {
    len(database) > LEN_MAX
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

fn len(database: &Path) -> u64 {
    fs::metadata(path(database)).map_or(0, |metadata| metadata.len())
}

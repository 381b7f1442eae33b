//! Marks the main file of a database in use, so that a copy without its write-ahead log can be
//! recognised.
//!
//! SQLite appends commits to a log beside the main file, and moves them into the main file from
//! time to time. The main file alone is a sound database of an earlier moment, so a copy of it
//! could pass for the whole. Therefore the main file contains a flag, "needs its log", and the log
//! clears this flag. Both files together have no flag, also after any program has merged them. A
//! copy of the main file alone has the flag.

use std::{
    fs,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, config::DbConfig};

use super::Store;

/// Number of pages in the log at which it is moved into the main file; SQLite's default.
const N_PAGES_MAX: u32 = 1000;

/// Keeps the log when the connection closes. Otherwise SQLite moves it into the main file, and
/// deletes it.
const KEEPS_LOG: DbConfig = DbConfig::SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE;

/// Makes this program move the log, instead of SQLite.
pub fn configure(connection: &Connection) -> rusqlite::Result<()> {
    connection.pragma_update(None, "wal_autocheckpoint", 0)
}

/// The path of a database's log.
pub fn path(database: &Path) -> PathBuf {
    let mut path = database.as_os_str().to_owned();
    path.push("-wal");
    path.into()
}

/// Whether a database has a log that is not empty.
pub fn exists(database: &Path) -> bool {
    fs::metadata(path(database)).is_ok_and(|metadata| metadata.len() > 0)
}

/// Moves the log into the main file if it is long.
pub fn fold_if_long(connection: &Connection) -> rusqlite::Result<()> {
    let mut statement = connection.prepare_cached("PRAGMA wal_checkpoint(NOOP)")?;
    let n_pages: u32 = statement.query_row([], |row| row.get(1))?;
    if n_pages < N_PAGES_MAX { Ok(()) } else { fold(connection) }
}

/// Whether the database has the flag that its log is missing.
pub fn is_missed(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row("SELECT needs_log FROM identity", [], |row| row.get(0))
}

/// Moves as much of the log into the main file as readers allow.
pub fn fold(connection: &Connection) -> rusqlite::Result<()> {
    set_missed(connection, true)?;
    // Never waits: pages that a reader still needs stay in the log.
    let folded = connection.query_row("PRAGMA wal_checkpoint(PASSIVE)", [], |_| Ok(()));
    clear(connection)?;
    folded
}

/// Clears the flag. If that fails, for instance because the disk is full, the log outlives the
/// connection: without it, the main file would still have the flag.
fn clear(connection: &Connection) -> rusqlite::Result<()> {
    let cleared = set_missed(connection, false);
    connection.set_db_config(KEEPS_LOG, cleared.is_err())?;
    cleared
}

impl Drop for Store {
    /// Clears a flag that could not be cleared before, so that the main file needs no log.
    fn drop(&mut self) {
        if self.connection.db_config(KEEPS_LOG) == Ok(true) {
            // After another failure, the log stays, and the next start reads it.
            let _ = clear(&self.connection);
        }
    }
}

/// Sets or clears the flag.
pub fn set_missed(connection: &Connection, is_missed: bool) -> rusqlite::Result<()> {
    connection.execute("UPDATE identity SET needs_log = ?1", [is_missed])?;
    Ok(())
}

//! Makes complete copies of a database, in use or not.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use rusqlite::Connection;

use super::{
    super::{Result, StoreError, file, schema, write_ahead_log},
    Inspection, inspect_file,
};

/// The outcome of a backup.
#[derive(Debug)]
pub enum Backup {
    /// The copy is complete. It contains damaged experiments unchanged, and reports them as
    /// findings; everything else is sound.
    Made(Inspection),
    /// The database as a whole is damaged, so there is no copy.
    Damaged(Inspection),
}

/// Copies a data directory to `to`, whether or not a coordinator uses it. The copy has the state
/// of one moment, and is inspected.
pub fn backup(directory: &Path, to: &Path) -> Result<Backup> {
    let from = file::path_in(directory);
    file::must_exist(&from)?;
    let restore = format!(
        "restore an earlier backup, or keep what is sound: \
         `swarmctl doctor --data-dir {} --recover NEW`",
        directory.display()
    );
    let unfinished = prepare(to)?;
    let copied = copy(&from, &unfinished).map_err(|error| error.at(&from));
    let inspection = match copied.and_then(|()| inspect_file(&unfinished, &restore)) {
        Ok(inspection) => inspection,
        Err(error) => {
            abandon(to);
            return Err(error);
        }
    };
    // A damaged experiment does not prevent the backup of others.
    if inspection.findings.iter().any(|finding| finding.experiment.is_none()) {
        abandon(to);
        return Ok(Backup::Damaged(Inspection { path: from, ..inspection }));
    }
    let failed = |source| StoreError::Target { path: to.to_owned(), source };
    file::publish(to).map_err(failed)?;
    Ok(Backup::Made(Inspection { path: file::path_in(to), ..inspection }))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let has_log = write_ahead_log::exists(from);
    let source = file::open_read_only(from)?;
    let is_sealed = schema::version(&source)? >= schema::SEALED;
    if is_sealed && !has_log && write_ahead_log::is_missed(&source)? {
        return Err(StoreError::WithoutLog { path: from.to_owned() });
    }
    // The statement reads in one transaction, so the copy has no later commits. It omits unused
    // pages.
    let to_name = to.to_str().ok_or_else(|| StoreError::Target {
        path: to.to_owned(),
        source: io::Error::other("its name is not UTF-8"),
    })?;
    source.execute("VACUUM INTO ?1", [to_name])?;
    if is_sealed {
        // The original has the flag if it has just moved its log. The copy needs no log.
        write_ahead_log::set_missed(&Connection::open(to)?, false)?;
    }
    Ok(())
}

/// Creates the directory of a new database; returns the database's path until it is complete.
pub fn prepare(to: &Path) -> Result<PathBuf> {
    let failed = |source: io::Error| StoreError::Target { path: to.to_owned(), source };
    fs::create_dir_all(to).map_err(failed)?;
    let unfinished = file::unfinished_in(to);
    for entry in fs::read_dir(to).map_err(failed)? {
        // An interrupted attempt left this file.
        if entry.map_err(failed)?.path() != unfinished {
            return Err(StoreError::NotEmpty { path: to.to_owned() });
        }
        fs::remove_file(&unfinished).map_err(failed)?;
    }
    Ok(unfinished)
}

/// Removes the directory of [`prepare`], and its files.
pub fn abandon(to: &Path) {
    // Remaining files are not mistaken for a database.
    let _ = fs::remove_file(file::unfinished_in(to));
    let _ = fs::remove_dir(to);
}

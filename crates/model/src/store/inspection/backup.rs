//! Copies of a database, in use or not, that are whole.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use rusqlite::Connection;

use super::{
    super::{Result, StoreError, file, schema, write_ahead_log},
    Inspection, inspect_file,
};

/// What became of a backup.
#[derive(Debug)]
pub enum Backup {
    /// The copy is where it was wanted. Experiments that are damaged are in it as they are, and
    /// are findings; everything else is sound.
    Made(Inspection),
    /// The database as a whole is damaged, so that there is no copy.
    Damaged(Inspection),
}

/// Makes the data directory `to` a copy of another one, whether or not a coordinator
/// uses that; of one moment, and looked through.
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
    // A damaged experiment takes no other one's backup.
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
    // One read transaction: what a coordinator commits meanwhile is not in it. Unused pages
    // are left out.
    let to_name = to.to_str().ok_or_else(|| StoreError::Target {
        path: to.to_owned(),
        source: io::Error::other("its name is not UTF-8"),
    })?;
    source.execute("VACUUM INTO ?1", [to_name])?;
    if is_sealed {
        // The log of the original may just have been moved.
        write_ahead_log::set_missed(&Connection::open(to)?, false)?;
    }
    Ok(())
}

/// Makes the directory of a new database; returns what the database is called until it
/// is complete.
pub fn prepare(to: &Path) -> Result<PathBuf> {
    let failed = |source: io::Error| StoreError::Target { path: to.to_owned(), source };
    fs::create_dir_all(to).map_err(failed)?;
    let unfinished = file::unfinished_in(to);
    for entry in fs::read_dir(to).map_err(failed)? {
        // Left by an attempt that was interrupted.
        if entry.map_err(failed)?.path() != unfinished {
            return Err(StoreError::NotEmpty { path: to.to_owned() });
        }
        fs::remove_file(&unfinished).map_err(failed)?;
    }
    Ok(unfinished)
}

/// Removes what [`prepare`] made, and what was written there.
pub fn abandon(to: &Path) {
    // What cannot be removed is not taken for a database.
    let _ = fs::remove_file(file::unfinished_in(to));
    let _ = fs::remove_dir(to);
}

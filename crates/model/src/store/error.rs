//! The errors of the store, each with the next step.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::Holder;
use crate::ids::ExperimentId;

/// An error of the store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The directory cannot be created or written. Fix its path or permissions.
    #[error(
        "cannot use the data directory {}: {source}; let the coordinator's user write there, or \
         choose another with --data-dir",
        path.display()
    )]
    Directory {
        /// The directory.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Another coordinator uses the directory.
    #[error(
        "the data directory {} is in use by another coordinator or `swarmctl run`{}; {}",
        path.display(),
        holder.as_ref().map_or_else(String::new, |holder| format!(" ({holder})")),
        match holder.as_ref().and_then(|holder| holder.address.as_deref()) {
            Some(address) => format!(
                "ask it with --coordinator {address}, stop it or choose another directory"
            ),
            None => "stop it or choose another directory".to_owned(),
        }
    )]
    Locked {
        /// The directory.
        path: PathBuf,
        /// The program that uses it, if known.
        holder: Option<Holder>,
    },
    /// Another coordinator has opened the database since, and owns it now.
    #[error(
        "another coordinator has taken over the data directory {}; this one stops and loses \
         nothing: run one coordinator per data directory",
        path.display()
    )]
    TakenOver {
        /// The directory.
        path: PathBuf,
    },
    /// The database was written by a newer version.
    #[error(
        "the database has schema version {found}, this program knows up to {supported}; \
         use the newer program, or another data directory"
    )]
    Newer {
        /// Version of the database.
        found: i64,
        /// Version of this program.
        supported: i64,
    },
    /// The database has an old version, which has to be migrated before it can be read.
    #[error(
        "{} has schema version {found}, which has no seals; start a coordinator on its directory \
         once, which migrates it",
        path.display()
    )]
    TooOld {
        /// Version of the database.
        found: i64,
        /// The database.
        path: PathBuf,
    },
    /// The database was opened read-only.
    #[error("{} is open for reading only", path.display())]
    ReadOnly {
        /// The database.
        path: PathBuf,
    },
    /// The database's content is invalid.
    #[error(
        "the database is damaged: {0}; restore it from a copy, or let `swarmctl doctor \
         --data-dir DIR` find its sound parts"
    )]
    Corrupt(String),
    /// The database is a copy of one in use, and lacks the data outside the copied file.
    #[error(
        "{} is a copy of a database in use without its write-ahead log: the latest generations are \
         missing; copy it with `swarmctl backup`, or continue from what is there: \
         `swarmctl doctor --data-dir {} --recover NEW`",
        path.display(),
        directory(path).display()
    )]
    WithoutLog {
        /// The database.
        path: PathBuf,
    },
    /// The state from which a run would continue differs from the stored one.
    #[error(
        "experiment {id} is damaged and does not continue: {what}; \
         `swarmctl doctor --data-dir {}` says what can be done",
        directory(path).display()
    )]
    Unsound {
        /// The experiment.
        id: ExperimentId,
        /// The damage.
        what: String,
        /// The database.
        path: PathBuf,
    },
    /// An ended experiment is sound, but has no state from which it could continue.
    #[error(
        "experiment {0} has ended, and no state is left from which it could continue: its \
         fitness log was damaged, or an older version kept none; submit its file again to \
         recompute it"
    )]
    NoCheckpoint(ExperimentId),
    /// There is no database to inspect or copy.
    #[error("there is no database {}; give the coordinator's --data-dir", path.display())]
    NoDatabase {
        /// The expected path.
        path: PathBuf,
    },
    /// No experiment of a damaged database is sound enough for a new data directory.
    #[error("no experiment in {} is sound; restore a backup", path.display())]
    NothingSound {
        /// The database.
        path: PathBuf,
    },
    /// The target of a new data directory is not empty.
    #[error("{} is not empty; choose a directory that does not exist yet", path.display())]
    NotEmpty {
        /// The directory.
        path: PathBuf,
    },
    /// A new data directory cannot be written.
    #[error("cannot write to {}: {source}; is the disk full, or read-only?", path.display())]
    Target {
        /// The directory.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The disk is full or fails, or memory is short; try again later.
    #[error(
        "the database cannot be read or written: {0}; is the disk full, or read-only, or memory \
         short?"
    )]
    Unavailable(rusqlite::Error),
    /// The experiment has ended meanwhile.
    #[error("experiment {0} has ended")]
    Ended(ExperimentId),
    /// The experiment has not ended, and needs its fitness log to continue.
    #[error(
        "experiment {0} has not ended, and needs its fitness log to continue; prune it after its end"
    )]
    Unfinished(ExperimentId),
    /// The experiment has been reopened and has ended again since its state was read.
    #[error("experiment {0} went on meanwhile; repeat the command")]
    WentOn(ExperimentId),
    /// The parent of a new fork was deleted during the fork's check, or its history is damaged.
    #[error(
        "there is no experiment {0} with the generations that its fork would share; \
         `swarmctl list` shows all experiments"
    )]
    ParentGone(ExperimentId),
    /// Forks of the experiment share generations with it that are stored nowhere else.
    #[error(
        "the fitness log of experiment {id} has the only copy of generations of its {}; \
         to lose them, delete {} first: {}",
        named(forks, "fork", "forks"),
        if forks.len() == 1 { "that" } else { "those" },
        forks.iter().map(|fork| format!("swarmctl delete {fork}")).collect::<Vec<_>>().join("; ")
    )]
    NeededByForks {
        /// The experiment.
        id: ExperimentId,
        /// Its forks, the latest first.
        forks: Vec<ExperimentId>,
    },
    /// Any other error is a bug.
    #[error("the database refuses an operation: {0}; please report this")]
    Bug(rusqlite::Error),
}

/// The result of an operation of the store.
pub type Result<T, E = StoreError> = std::result::Result<T, E>;

impl StoreError {
    /// Adds the path of the damaged database.
    pub fn at(self, path: &Path) -> Self {
        match self {
            Self::Corrupt(what) => Self::Corrupt(format!("{}: {what}", path.display())),
            other => other,
        }
    }
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        use rusqlite::ErrorCode::{
            CannotOpen, DatabaseBusy, DatabaseCorrupt, DatabaseLocked, DiskFull, NotADatabase,
            OutOfMemory, ReadOnly, SystemIoFailure,
        };
        let code = error.sqlite_error_code();
        // Any statement may report this.
        if code == Some(OutOfMemory) {
            return Self::Unavailable(error);
        }
        // Every query uses the types of the schema, and expects rows that must exist.
        if matches!(
            error,
            rusqlite::Error::FromSqlConversionFailure(..)
                | rusqlite::Error::IntegralValueOutOfRange(..)
                | rusqlite::Error::InvalidColumnType(..)
                | rusqlite::Error::Utf8Error(..)
                | rusqlite::Error::QueryReturnedNoRows
        ) {
            return Self::Corrupt(error.to_string());
        }
        // Statements fit the schema, so other tables are damage, or belong to another program.
        // SQLite's message begins with the fault, and ends with the whole statement.
        let missing = match &error {
            rusqlite::Error::SqlInputError { msg, .. } => Some(msg),
            rusqlite::Error::SqliteFailure(_, Some(msg)) if msg.starts_with("no such") => Some(msg),
            _ => None,
        };
        if let Some(what) = missing {
            return Self::Corrupt(format!("its tables are not those of its version: {what}"));
        }
        match code {
            Some(DatabaseCorrupt | NotADatabase) => Self::Corrupt(error.to_string()),
            Some(
                CannotOpen | DatabaseBusy | DatabaseLocked | DiskFull | ReadOnly | SystemIoFailure,
            ) => Self::Unavailable(error),
            _ => Self::Bug(error),
        }
    }
}

/// "fork 3", "forks 4, 3".
fn named(ids: &[ExperimentId], one: &str, several: &str) -> String {
    let what = if ids.len() == 1 { one } else { several };
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    format!("{what} {}", ids.join(", "))
}

/// The directory of a database.
fn directory(path: &Path) -> &Path {
    path.parent().unwrap_or(path)
}

//! The coordinator's memory: a SQLite database that holds every completed
//! generation, and from which a killed coordinator goes on.
//!
//! Every method that changes something is one transaction, on disk when it
//! returns.

mod champions;
mod file;
mod history;
mod records;
mod schema;

use std::{
    fs::File,
    io,
    path::{Path, PathBuf},
};

use rusqlite::{Connection, OptionalExtension, Row, Transaction, params};

use crate::{failpoint, ids::ExperimentId, priority::Priority};
use evolution::Champion;

pub use records::{
    Event, EventKind, ExperimentRecord, ExperimentState, GenerationRecord, NewExperiment,
    checkpoint_json,
};

/// The open database of one data directory.
#[derive(Debug)]
pub struct Store {
    connection: Connection,
    /// Held for as long as the store is open: one coordinator per directory.
    _lock: File,
}

/// What went wrong with the store.
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
        /// What the system says.
        source: io::Error,
    },
    /// Another coordinator uses the directory.
    #[error(
        "the data directory {} is in use by another coordinator; stop it or choose another directory",
        path.display()
    )]
    Locked {
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
    /// The database's content makes no sense.
    #[error(
        "the database is damaged: {0}; restore it from a copy, or choose another data directory"
    )]
    Corrupt(String),
    /// The disk is full, or cannot be read or written; try again later.
    #[error("the database cannot be read or written: {0}; is the disk full, or read-only?")]
    Unavailable(rusqlite::Error),
    /// The experiment has ended meanwhile.
    #[error("experiment {0} has ended")]
    Ended(ExperimentId),
    /// Anything else is a bug.
    #[error("the database refuses an operation: {0}; please report this")]
    Bug(rusqlite::Error),
}

impl From<rusqlite::Error> for StoreError {
    fn from(error: rusqlite::Error) -> Self {
        use rusqlite::ErrorCode::{
            CannotOpen, DatabaseBusy, DatabaseCorrupt, DatabaseLocked, DiskFull, NotADatabase,
            ReadOnly, SystemIoFailure,
        };
        if matches!(
            error,
            rusqlite::Error::FromSqlConversionFailure(..)
                | rusqlite::Error::IntegralValueOutOfRange(..)
                | rusqlite::Error::InvalidColumnType(..)
        ) {
            return Self::Corrupt(error.to_string());
        }
        match error.sqlite_error_code() {
            Some(DatabaseCorrupt | NotADatabase) => Self::Corrupt(error.to_string()),
            Some(
                CannotOpen | DatabaseBusy | DatabaseLocked | DiskFull | ReadOnly | SystemIoFailure,
            ) => Self::Unavailable(error),
            _ => Self::Bug(error),
        }
    }
}

type Result<T> = std::result::Result<T, StoreError>;

/// A generation to be committed.
#[derive(Debug, Clone)]
pub struct GenerationCommit<'a> {
    /// History row.
    pub generation: &'a GenerationRecord,
    /// Evolution after it, as JSON.
    pub checkpoint: &'a str,
    /// The champion so far.
    pub champion: Option<&'a Champion>,
    /// Covers all generations and re-evaluations so far.
    pub digest: &'a str,
    /// Things worth a line.
    pub notices: &'a [String],
    /// Whether this was the last generation, and why.
    pub completed: Option<&'a str>,
}

impl Store {
    /// Opens, and if need be creates, the database in `directory`.
    pub fn open(directory: &Path) -> Result<Self> {
        let (connection, lock) = file::open(directory)?;
        Ok(Self { connection, _lock: lock })
    }

    /// Adds an experiment. If `request_id` has been used before, nothing is
    /// added and the id of that experiment is returned.
    pub fn create(&mut self, new: &NewExperiment, now_ms: u64) -> Result<(ExperimentId, bool)> {
        if let Some(request_id) = &new.request_id
            && let Some(id) = self.experiment_of_request(request_id)?
        {
            return Ok((id, false));
        }
        let transaction = self.connection.transaction()?;
        transaction.execute(
            "INSERT INTO experiments (request_id, name, config, config_digest, fingerprint,
                                      genotype_len, state, submitted_at_ms, priority)
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, 'running', ?7, ?8)",
            params![
                new.request_id,
                new.config.name,
                new.config.to_canonical_json(),
                new.config_digest.to_string(),
                sim_core::FINGERPRINT,
                new.genotype_len,
                now_ms,
                new.priority.weight()
            ],
        )?;
        let id = ExperimentId(transaction.last_insert_rowid().unsigned_abs());
        transaction.execute(
            "INSERT INTO checkpoints (experiment_id, state) VALUES (?1, ?2)",
            params![id.0, new.checkpoint],
        )?;
        let state = ExperimentState::Running;
        add_state_event(&transaction, id, now_ms, state, "submitted")?;
        transaction.commit()?;
        Ok((id, true))
    }

    /// The experiment that was created under a client's key.
    pub fn experiment_of_request(&self, request_id: &str) -> Result<Option<ExperimentId>> {
        let mut statement =
            self.connection.prepare_cached("SELECT id FROM experiments WHERE request_id = ?1")?;
        Ok(statement.query_row([request_id], |row| row.get(0).map(ExperimentId)).optional()?)
    }

    /// Commits a generation with everything that belongs to it;
    /// [`StoreError::Ended`] if the experiment has ended. One that was paused after
    /// its generation had been evaluated keeps the generation, and stays paused.
    pub fn commit_generation(
        &mut self,
        id: ExperimentId,
        now_ms: u64,
        commit: &GenerationCommit<'_>,
    ) -> Result<()> {
        let transaction = self.connection.transaction()?;
        let state: String = transaction.query_row(
            "SELECT state FROM experiments WHERE id = ?1",
            [id.0],
            |row| row.get(0),
        )?;
        if !ExperimentState::from_name(&state).is_some_and(ExperimentState::is_unfinished) {
            return Err(StoreError::Ended(id));
        }
        let generation = commit.generation;
        let statistics = &generation.statistics;
        transaction.execute(
            "INSERT INTO generations VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11)",
            params![
                id.0,
                generation.generation,
                statistics.best,
                statistics.mean,
                statistics.min,
                statistics.standard_deviation,
                generation.digest,
                generation.duration_ms,
                generation.episodes,
                generation.workers,
                generation.idle_share
            ],
        )?;
        failpoint::reached("history written");
        transaction.execute(
            "UPDATE checkpoints SET state = ?2 WHERE experiment_id = ?1",
            params![id.0, commit.checkpoint],
        )?;
        transaction.execute(
            "UPDATE experiments SET digest = ?2 WHERE id = ?1",
            params![id.0, commit.digest],
        )?;
        if let Some(champion) = commit.champion {
            champions::put(&transaction, id, champion)?;
        }
        for notice in commit.notices {
            add_notice(&transaction, id, now_ms, notice)?;
        }
        transaction.execute(
            "INSERT INTO events (experiment_id, sequence, at_ms, kind, generation)
             VALUES (?1, (SELECT ifnull(max(sequence), 0) + 1 FROM events WHERE experiment_id = ?1),
                     ?2, 'generation', ?3)",
            params![id.0, now_ms, generation.generation],
        )?;
        if let Some(reason) = commit.completed {
            set_state(&transaction, id, now_ms, ExperimentState::Completed, reason)?;
        }
        failpoint::reached("commit prepared");
        transaction.commit()?;
        Ok(())
    }

    /// Changes the state of an unfinished experiment; one that has ended, or is in
    /// that state already, stays as it is.
    pub fn set_state(
        &mut self,
        id: ExperimentId,
        now_ms: u64,
        state: ExperimentState,
        reason: &str,
    ) -> Result<()> {
        let transaction = self.connection.transaction()?;
        set_state(&transaction, id, now_ms, state, reason)?;
        transaction.commit()?;
        Ok(())
    }

    /// Changes the priority of an unfinished experiment; one that has ended stays
    /// as it is.
    pub fn set_priority(&mut self, id: ExperimentId, priority: Priority) -> Result<()> {
        self.connection.execute(
            "UPDATE experiments SET priority = ?2
             WHERE id = ?1 AND state IN ('running', 'paused')",
            params![id.0, priority.weight()],
        )?;
        Ok(())
    }

    /// Adds a line to an experiment's events.
    pub fn notice(&mut self, id: ExperimentId, now_ms: u64, text: &str) -> Result<()> {
        let transaction = self.connection.transaction()?;
        add_notice(&transaction, id, now_ms, text)?;
        transaction.commit()?;
        Ok(())
    }

    /// Lets a completed experiment go on under a configuration that asks for
    /// more generations.
    pub fn reopen(&mut self, id: ExperimentId, config_json: &str, now_ms: u64) -> Result<()> {
        let transaction = self.connection.transaction()?;
        let n_changed = transaction.execute(
            "UPDATE experiments SET state = 'running', reason = '', config = ?2
             WHERE id = ?1 AND state = 'completed'",
            params![id.0, config_json],
        )?;
        if n_changed > 0 {
            let state = ExperimentState::Running;
            add_state_event(&transaction, id, now_ms, state, "more generations")?;
        }
        transaction.commit()?;
        Ok(())
    }

    /// Reads one experiment.
    pub fn experiment(&self, id: ExperimentId) -> Result<Option<ExperimentRecord>> {
        if i64::try_from(id.0).is_err() {
            return Ok(None); // SQLite's integers are signed.
        }
        let mut statement =
            self.connection.prepare_cached(&format!("{SELECT_EXPERIMENT} WHERE e.id = ?1"))?;
        statement.query_row([id.0], read_experiment).optional()?.transpose()
    }

    /// Reads all experiments, oldest first.
    pub fn experiments(&self) -> Result<Vec<ExperimentRecord>> {
        let mut statement =
            self.connection.prepare_cached(&format!("{SELECT_EXPERIMENT} ORDER BY e.id"))?;
        let rows = statement.query_map([], read_experiment)?;
        rows.map(|row| row?).collect()
    }

    /// The state of evolution after the latest generation, as JSON.
    pub fn checkpoint(&self, id: ExperimentId) -> Result<Option<String>> {
        let mut statement = self
            .connection
            .prepare_cached("SELECT state FROM checkpoints WHERE experiment_id = ?1")?;
        Ok(statement.query_row([id.0], |row| row.get(0)).optional()?)
    }

    /// The champion so far; none before the first generation.
    pub fn champion(&self, id: ExperimentId) -> Result<Option<Champion>> {
        champions::get(&self.connection, id)
    }
}

const SELECT_EXPERIMENT: &str =
    "SELECT e.id, e.config, e.config_digest, e.fingerprint, e.genotype_len, e.state, e.reason,
            e.submitted_at_ms, e.digest, c.held_out_mean, c.trial_fitness,
            g.generation, g.best, g.mean, g.min, g.standard_deviation, g.digest,
            g.duration_ms, g.episodes, g.workers, g.idle_share, e.priority,
            (SELECT max(sequence) FROM events WHERE experiment_id = e.id)
     FROM experiments e
     LEFT JOIN champions c ON c.experiment_id = e.id
     LEFT JOIN generations g ON g.experiment_id = e.id AND g.generation =
               (SELECT max(generation) FROM generations WHERE experiment_id = e.id)";

fn read_experiment(row: &Row<'_>) -> rusqlite::Result<Result<ExperimentRecord>> {
    let id = ExperimentId(row.get(0)?);
    let state: String = row.get(5)?;
    let Some(state) = ExperimentState::from_name(&state) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has state \"{state}\""))));
    };
    let Some(priority) = Priority::new(row.get(21)?) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has no valid priority"))));
    };
    let trial_fitness: Option<String> = row.get(10)?;
    let champion_fitness = match (row.get(9)?, trial_fitness) {
        (Some(held_out), _) => Some(held_out),
        (None, Some(trial_fitness)) => champions::mean(&trial_fitness),
        (None, None) => None,
    };
    Ok(Ok(ExperimentRecord {
        id,
        config_json: row.get(1)?,
        config_digest: row.get(2)?,
        fingerprint: row.get(3)?,
        genotype_len: row.get(4)?,
        state,
        reason: row.get(6)?,
        submitted_at_ms: row.get(7)?,
        digest: row.get(8)?,
        champion_fitness,
        latest: history::read_generation(row, 11)?,
        priority,
        last_sequence: row.get::<_, Option<u64>>(22)?.unwrap_or_default(),
    }))
}

fn set_state(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    now_ms: u64,
    state: ExperimentState,
    reason: &str,
) -> rusqlite::Result<()> {
    let n_changed = transaction.execute(
        "UPDATE experiments SET state = ?2, reason = ?3
         WHERE id = ?1 AND state IN ('running', 'paused') AND state <> ?2",
        params![id.0, state.name(), reason],
    )?;
    if n_changed > 0 {
        add_state_event(transaction, id, now_ms, state, reason)?;
    }
    Ok(())
}

fn add_state_event(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    now_ms: u64,
    state: ExperimentState,
    reason: &str,
) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT INTO events (experiment_id, sequence, at_ms, kind, state, message)
         VALUES (?1, (SELECT ifnull(max(sequence), 0) + 1 FROM events WHERE experiment_id = ?1),
                 ?2, 'state', ?3, ?4)",
        params![id.0, now_ms, state.name(), reason],
    )?;
    Ok(())
}

fn add_notice(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    now_ms: u64,
    text: &str,
) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT INTO events (experiment_id, sequence, at_ms, kind, message)
         VALUES (?1, (SELECT ifnull(max(sequence), 0) + 1 FROM events WHERE experiment_id = ?1),
                 ?2, 'notice', ?3)",
        params![id.0, now_ms, text],
    )?;
    Ok(())
}

/// For tests that make the database fail.
#[cfg(test)]
impl Store {
    /// The connection.
    pub fn connection(&self) -> &Connection {
        &self.connection
    }
}

#[cfg(test)]
mod tests;

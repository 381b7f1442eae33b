//! The coordinator's memory: a SQLite database that holds every completed
//! generation, and from which a killed coordinator goes on.
//!
//! Every method that changes something is one transaction, on disk when it
//! returns, and refused if another coordinator owns the database by now.

mod champions;
mod checkpoints;
mod error;
mod file;
mod history;
mod inspection;
mod quarantine;
mod records;
mod schema;
mod seals;
mod soundness;
mod write_ahead_log;

use std::path::{Path, PathBuf};

use rusqlite::{Connection, OptionalExtension, Row, Transaction, TransactionBehavior, params};

use crate::{failpoint, ids::ExperimentId, priority::Priority};
use evolution::{Advance, Champion};

pub use error::StoreError;
pub use inspection::{
    Backup, Fate, Finding, Inspection, Recovered, Recovery, backup, inspect, recover,
};
pub use quarantine::QuarantinedWorker;
pub use records::{
    Event, EventKind, ExperimentRecord, ExperimentState, GenerationRecord, NewExperiment,
};

use error::Result;
use file::Locks;
use seals::Sealer;

/// The open database of one data directory.
#[derive(Debug)]
pub struct Store {
    connection: Connection,
    /// The database.
    path: PathBuf,
    /// Makes the seals of its rows.
    sealer: Sealer,
    /// What the database says as long as this coordinator owns it.
    owner: Vec<u8>,
    /// Released after the connection.
    _locks: Locks,
}

/// A generation to be committed.
#[derive(Debug, Clone)]
pub struct GenerationCommit<'a> {
    /// History row.
    pub generation: &'a GenerationRecord,
    /// What it changes in the checkpoint.
    pub checkpoint: &'a Advance,
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
    /// Opens, and if need be creates, the database in `directory`, and takes it over
    /// from whoever owned it.
    pub fn open(directory: &Path) -> Result<Self> {
        let (connection, locks) = file::open(directory)?;
        let path = file::path_in(directory);
        let (owner, sealer) =
            claim(&connection).map_err(|error| StoreError::from(error).at(&path))?;
        Ok(Self { connection, path, sealer, owner, _locks: locks })
    }

    /// Adds an experiment. If `request_id` has been used before, nothing is
    /// added and the id of that experiment is returned.
    pub fn create(&mut self, new: &NewExperiment, now_ms: u64) -> Result<(ExperimentId, bool)> {
        if let Some(request_id) = &new.request_id
            && let Some(id) = self.experiment_of_request(request_id)?
        {
            return Ok((id, false));
        }
        self.write(|transaction, sealer| {
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
            seals::seal_experiment(transaction, sealer, id)?;
            let seal = sealer.checkpoint(id, None, &new.checkpoint);
            checkpoints::put(transaction, id, &new.checkpoint, seal)?;
            add_state_event(transaction, id, now_ms, ExperimentState::Running, "submitted")?;
            Ok((id, true))
        })
    }

    /// The experiment that was created under a client's key.
    pub fn experiment_of_request(&self, request_id: &str) -> Result<Option<ExperimentId>> {
        self.read(|connection| {
            let mut statement =
                connection.prepare_cached("SELECT id FROM experiments WHERE request_id = ?1")?;
            Ok(statement.query_row([request_id], |row| row.get(0).map(ExperimentId)).optional()?)
        })
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
        let generation = commit.generation;
        // Hashing takes longer than the rest, and needs no transaction.
        let seal = self.sealer.advance(id, generation, commit.checkpoint);
        self.write(|transaction, sealer| {
            let state: String = transaction
                .prepare_cached("SELECT state FROM experiments WHERE id = ?1")?
                .query_row([id.0], |row| row.get(0))?;
            if !ExperimentState::from_name(&state).is_some_and(ExperimentState::is_unfinished) {
                return Err(StoreError::Ended(id));
            }
            history::put(transaction, sealer, id, generation)?;
            failpoint::reached("history written");
            let number = generation.generation;
            checkpoints::advance(transaction, id, number, commit.checkpoint, seal)?;
            transaction
                .prepare_cached("UPDATE experiments SET digest = ?2 WHERE id = ?1")?
                .execute(params![id.0, commit.digest])?;
            match commit.champion {
                Some(champion) => {
                    let latest = Some(generation.generation);
                    champions::put(transaction, sealer, id, champion, latest, commit.digest)?;
                }
                None => champions::seal(transaction, sealer, id)?,
            }
            for notice in commit.notices {
                add_notice(transaction, id, now_ms, notice)?;
            }
            transaction
                .prepare_cached(
                    "INSERT INTO events (experiment_id, sequence, at_ms, kind, generation)
                     VALUES (?1,
                             (SELECT ifnull(max(sequence), 0) + 1 FROM events
                              WHERE experiment_id = ?1),
                             ?2, 'generation', ?3)",
                )?
                .execute(params![id.0, now_ms, generation.generation])?;
            if let Some(reason) = commit.completed {
                set_state(transaction, id, now_ms, ExperimentState::Completed, reason)?;
            }
            failpoint::reached("commit prepared");
            Ok(())
        })
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
        self.write(|transaction, _| Ok(set_state(transaction, id, now_ms, state, reason)?))
    }

    /// Changes the priority of an unfinished experiment; one that has ended stays
    /// as it is.
    pub fn set_priority(&mut self, id: ExperimentId, priority: Priority) -> Result<()> {
        self.write(|transaction, _| {
            transaction.execute(
                "UPDATE experiments SET priority = ?2
                 WHERE id = ?1 AND state IN ('running', 'paused')",
                params![id.0, priority.weight()],
            )?;
            Ok(())
        })
    }

    /// Adds a line to an experiment's events.
    pub fn notice(&mut self, id: ExperimentId, now_ms: u64, text: &str) -> Result<()> {
        self.write(|transaction, _| Ok(add_notice(transaction, id, now_ms, text)?))
    }

    /// Lets a completed experiment go on under a configuration that asks for
    /// more generations.
    pub fn reopen(&mut self, id: ExperimentId, config_json: &str, now_ms: u64) -> Result<()> {
        self.write(|transaction, sealer| {
            let n_changed = transaction.execute(
                "UPDATE experiments SET state = 'running', reason = '', config = ?2
                 WHERE id = ?1 AND state = 'completed'",
                params![id.0, config_json],
            )?;
            if n_changed > 0 {
                seals::seal_experiment(transaction, sealer, id)?;
                let state = ExperimentState::Running;
                add_state_event(transaction, id, now_ms, state, "more generations")?;
            }
            Ok(())
        })
    }

    /// Reads one experiment.
    pub fn experiment(&self, id: ExperimentId) -> Result<Option<ExperimentRecord>> {
        self.read(|connection| experiment(connection, id))
    }

    /// Reads all experiments, oldest first.
    pub fn experiments(&self) -> Result<Vec<ExperimentRecord>> {
        self.read(|connection| {
            let mut statement =
                connection.prepare_cached(&format!("{SELECT_EXPERIMENT} ORDER BY e.id"))?;
            let rows = statement.query_map([], read_experiment)?;
            rows.map(|row| row?).collect()
        })
    }

    /// The champion so far; none before the first generation.
    pub fn champion(&self, id: ExperimentId) -> Result<Option<Champion>> {
        self.read(|connection| champions::get(connection, Some(&self.sealer), id))
    }

    /// Reads.
    fn read<T>(&self, query: impl FnOnce(&Connection) -> Result<T>) -> Result<T> {
        query(&self.connection).map_err(|error| error.at(&self.path))
    }

    /// Writes in one transaction, if this coordinator still owns the database.
    fn write<T>(
        &mut self,
        operation: impl FnOnce(&Transaction<'_>, &Sealer) -> Result<T>,
    ) -> Result<T> {
        let result = self.transact(operation).map_err(|error| error.at(&self.path))?;
        // What is written is on disk anyway; the next write tries again.
        let _ = write_ahead_log::fold_if_long(&self.connection);
        Ok(result)
    }

    fn transact<T>(
        &mut self,
        operation: impl FnOnce(&Transaction<'_>, &Sealer) -> Result<T>,
    ) -> Result<T> {
        let transaction =
            self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        if owner(&transaction)? != self.owner {
            let path = self.path.parent().unwrap_or(&self.path).to_owned();
            return Err(StoreError::TakenOver { path });
        }
        let result = operation(&transaction, &self.sealer)?;
        transaction.commit()?;
        Ok(result)
    }
}

/// Makes this coordinator the owner of a database; returns its token, and the sealer.
fn claim(connection: &Connection) -> rusqlite::Result<(Vec<u8>, Sealer)> {
    connection.execute("UPDATE identity SET owner = randomblob(16)", [])?;
    let owner = owner(connection)?;
    write_ahead_log::fold(connection)?;
    Ok((owner, Sealer::of(connection)?))
}

/// The token of the coordinator that owns a database.
fn owner(connection: &Connection) -> rusqlite::Result<Vec<u8>> {
    connection.prepare_cached("SELECT owner FROM identity")?.query_row([], |row| row.get(0))
}

fn experiment(connection: &Connection, id: ExperimentId) -> Result<Option<ExperimentRecord>> {
    if i64::try_from(id.0).is_err() {
        return Ok(None); // SQLite's integers are signed.
    }
    let mut statement =
        connection.prepare_cached(&format!("{SELECT_EXPERIMENT} WHERE e.id = ?1"))?;
    statement.query_row([id.0], read_experiment).optional()?.transpose()
}

const SELECT_EXPERIMENT: &str =
    "SELECT e.id, e.config, e.config_digest, e.fingerprint, e.genotype_len, e.state, e.reason,
            e.submitted_at_ms, e.digest, c.held_out_mean, c.judged_mean,
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
        held_out_fitness: row.get(9)?,
        judged_fitness: row.get(10)?,
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
        checkpoints::delete_unless_of_use(transaction, id, state, reason)?;
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

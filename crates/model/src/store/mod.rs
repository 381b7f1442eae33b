//! The coordinator's memory: a SQLite database with every completed generation, from which a
//! killed coordinator continues.
//!
//! Every method that changes data is one transaction. The transaction is on disk when the method
//! returns, and fails if another coordinator has taken over the database.

mod champions;
mod configs;
mod deletion;
mod error;
mod events;
mod evidence;
mod experiments;
mod file;
mod fitness_log;
mod forks;
mod history;
mod holder;
pub(crate) mod inspection;
mod labels;
mod older_schemas;
mod quarantine;
mod records;
mod schema;
mod sealing;
mod seals;
mod soundness;
mod summary;
mod write_ahead_log;

use std::path::{Path, PathBuf};

use rusqlite::{Connection, OptionalExtension, Transaction, TransactionBehavior, params};

use crate::{failpoint, ids::ExperimentId, priority::Priority};
use evolution::{Champion, Checkpoint};

pub use error::StoreError;
use events::{add_notice, add_state_event, set_state};
pub use evidence::Imported;
pub use experiments::Filter;
pub use file::holder;
pub use fitness_log::Entry;
pub use holder::Holder;
pub use inspection::{
    Backup, Fate, Finding, Inspection, Recovered, Recovery, backup, inspect, recover,
};
pub use quarantine::QuarantinedWorker;
pub use records::{
    Event, EventKind, Evidence, ExperimentRecord, ExperimentState, ForkRecord, GenerationRecord,
    LogEntry, LogGap, NewExperiment, StoredExperiment,
};
pub use summary::Summary;

use error::Result;
use file::{AtRest, Locks};
use seals::Sealer;

/// The open database of one data directory.
#[derive(Debug)]
pub struct Store {
    connection: Connection,
    /// The database.
    path: PathBuf,
    /// Makes the seals of its rows.
    sealer: Sealer,
    /// `None` if the database is only read.
    ownership: Option<Ownership>,
    /// The state of the file that the connection reads, if no program used the database.
    at_rest: Option<AtRest>,
}

/// A coordinator's right to write.
#[derive(Debug)]
struct Ownership {
    /// The owner's token; the database has the same one while this coordinator owns it.
    owner: Vec<u8>,
    /// Released after the connection.
    locks: Locks,
}

/// A generation to commit.
#[derive(Debug, Clone)]
pub struct GenerationCommit<'a> {
    /// History row.
    pub generation: &'a GenerationRecord,
    /// Its entry in the fitness log.
    pub entry: Entry<'a>,
    /// The present champion.
    pub champion: Option<&'a Champion>,
    /// The digest that covers all generations and re-evaluations so far.
    pub digest: &'a str,
    /// Notices for the events.
    pub notices: &'a [String],
    /// Why the run is over, if this is the last generation.
    pub completed: Option<&'a str>,
}

/// Whether there is a database in a directory.
pub fn is_in(directory: &Path) -> bool {
    file::path_in(directory).is_file()
}

/// Fails if there is no database in a directory.
pub fn must_be_in(directory: &Path) -> Result<()> {
    file::must_exist(&file::path_in(directory))
}

impl Store {
    /// Opens the database in `directory`, or creates it, and takes it over from its former owner.
    pub fn open(directory: &Path) -> Result<Self> {
        let (connection, locks) = file::open(directory)?;
        let path = file::path_in(directory);
        let (owner, sealer) =
            claim(&connection).map_err(|error| StoreError::from(error).at(&path))?;
        Ok(Self {
            connection,
            path,
            sealer,
            ownership: Some(Ownership { owner, locks }),
            at_rest: None,
        })
    }

    /// Opens the database in `directory` for reading, whether or not a coordinator uses it.
    /// Earlier versions are accepted if they have seals.
    pub fn open_read_only(directory: &Path) -> Result<Self> {
        must_be_in(directory)?;
        let path = file::path_in(directory);
        let at_rest = AtRest::look(&path);
        let open = || {
            let connection = file::open_read_only_as(&path, at_rest)?;
            let version = schema::version(&connection)?;
            if version > schema::VERSION {
                return Err(StoreError::Newer { found: version, supported: schema::VERSION });
            }
            if version < schema::SEALED {
                return Err(StoreError::TooOld { found: version, path: path.clone() });
            }
            if version < schema::VERSION {
                older_schemas::read_as_latest(&connection, version)?;
            }
            let sealer = Sealer::from_database(&connection)?;
            Ok((connection, sealer))
        };
        let (connection, sealer) = open().map_err(|error| error.at(&path))?;
        Ok(Self { connection, path, sealer, ownership: None, at_rest })
    }

    /// Opens the database again if it was at rest and is no longer: the old connection would read
    /// pages of both states, as if it was damaged. After a failure, the next call tries again.
    pub fn keep_up(&mut self) {
        if self.at_rest.is_none() || self.at_rest == AtRest::look(&self.path) {
            return;
        }
        if let Some(Ok(store)) = self.path.parent().map(Self::open_read_only) {
            *self = store;
        }
    }

    /// Announces the address of this program to other programs that want the directory.
    pub fn announce(&self, address: &str) {
        if let Some(Ownership { locks, .. }) = &self.ownership {
            locks.announce(Some(address));
        }
    }

    /// Adds an experiment. If an earlier experiment has the same `request_id`, adds nothing and
    /// returns the earlier id. Fails with [`StoreError::ParentGone`] if it is a fork of an
    /// experiment that lacks the shared generations.
    pub fn create(&mut self, new: &NewExperiment, now_ms: u64) -> Result<(ExperimentId, bool)> {
        if let Some(request_id) = &new.request_id
            && let Some(id) = self.experiment_of_request(request_id)?
        {
            return Ok((id, false));
        }
        self.write(|transaction, sealer| {
            transaction.execute(
                "INSERT INTO experiments (request_id, name, config_digest, fingerprint,
                                          genotype_len, state, submitted_at_ms, priority,
                                          group_name, variant, labels)
                 VALUES (?1, ?2, ?3, ?4, ?5, 'running', ?6, ?7, ?8, ?9, ?10)",
                params![
                    new.request_id,
                    new.config.name,
                    new.config_digest.to_string(),
                    sim_core::FINGERPRINT,
                    new.genotype_len,
                    now_ms,
                    new.priority.weight(),
                    new.membership.as_ref().map(|membership| &membership.group),
                    new.membership.as_ref().map(|membership| &membership.variant),
                    labels::to_json(&new.labels),
                ],
            )?;
            let id = ExperimentId(transaction.last_insert_rowid().unsigned_abs());
            configs::put(transaction, sealer, id, &new.config.to_canonical_json())?;
            add_state_event(transaction, id, now_ms, ExperimentState::Running, "submitted")?;
            let mut latest = None;
            if let Some(fork) = &new.fork {
                forks::put(transaction, sealer, id, fork)?;
                latest = Some(forks::copy_history(transaction, sealer, id, fork)?);
                let sql = "UPDATE experiments SET digest = ?2 WHERE id = ?1";
                transaction.execute(sql, params![id.0, fork.link])?;
                if let Some(champion) = &new.champion {
                    let (latest, link) = (Some(fork.generation), &fork.link);
                    champions::put(transaction, sealer, id, champion, latest, link)?;
                }
            }
            let n_generations = latest.as_ref().map_or(0, |latest| latest.generation + 1);
            let seal = sealer.keyframe(id, latest.as_ref(), &new.keyframe);
            fitness_log::put_keyframe(transaction, id, n_generations, &new.keyframe, seal)?;
            Ok((id, true))
        })
    }

    /// The experiment that a client created with this key.
    pub fn experiment_of_request(&self, request_id: &str) -> Result<Option<ExperimentId>> {
        self.read(|connection| {
            let mut statement =
                connection.prepare_cached("SELECT id FROM experiments WHERE request_id = ?1")?;
            Ok(statement.query_row([request_id], |row| row.get(0).map(ExperimentId)).optional()?)
        })
    }

    /// Commits a generation with its state, fitness log and champion. Fails with
    /// [`StoreError::Ended`] if the experiment has ended. An experiment that was paused after the
    /// evaluation gets the generation, and stays paused.
    pub fn commit_generation(
        &mut self,
        id: ExperimentId,
        now_ms: u64,
        commit: &GenerationCommit<'_>,
    ) -> Result<()> {
        let generation = commit.generation;
        // Hashing takes longest, and needs no transaction.
        let seals = commit.entry.seals(&self.sealer, id, generation);
        self.write(|transaction, sealer| {
            let state: Option<String> = transaction
                .prepare_cached("SELECT state FROM experiments WHERE id = ?1")?
                .query_row([id.0], |row| row.get(0))
                .optional()?;
            let state = state.as_deref().and_then(ExperimentState::from_name);
            if !state.is_some_and(ExperimentState::is_unfinished) {
                return Err(StoreError::Ended(id));
            }
            history::put(transaction, sealer, id, generation)?;
            failpoint::reached("history written");
            commit.entry.put(transaction, id, generation.generation, seals)?;
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

    /// Changes the state of an unfinished experiment, or the reason of a pause. Does nothing if
    /// the experiment has ended or is in that state already.
    pub fn set_state(
        &mut self,
        id: ExperimentId,
        now_ms: u64,
        state: ExperimentState,
        reason: &str,
    ) -> Result<()> {
        self.write(|transaction, _| Ok(set_state(transaction, id, now_ms, state, reason)?))
    }

    /// Changes the priority of an unfinished experiment; does nothing if it has ended.
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

    /// Adds a notice to an experiment's events.
    pub fn notice(&mut self, id: ExperimentId, now_ms: u64, text: &str) -> Result<()> {
        self.write(|transaction, _| Ok(add_notice(transaction, id, now_ms, text)?))
    }

    /// Reopens an experiment that has ended in the state `from`, with a configuration that may
    /// have more generations. Does nothing in another state. `why`: for its events.
    pub fn reopen(
        &mut self,
        id: ExperimentId,
        from: ExperimentState,
        config_json: &str,
        why: &str,
        now_ms: u64,
    ) -> Result<()> {
        self.write(|transaction, sealer| {
            let n_changed = transaction.execute(
                "UPDATE experiments SET state = 'running', reason = '', archived = 0
                 WHERE id = ?1 AND state = ?2 AND state NOT IN ('running', 'paused')",
                params![id.0, from.name()],
            )?;
            if n_changed > 0 {
                configs::put(transaction, sealer, id, config_json)?;
                add_state_event(transaction, id, now_ms, ExperimentState::Running, why)?;
            }
            Ok(())
        })
    }

    /// Deletes the fitness log of an experiment that has ended, unless forks share generations of
    /// it ([`StoreError::NeededByForks`]). `keyframe`: the state of evolution after
    /// `n_generations`, from which more generations would continue. Fails with
    /// [`StoreError::WentOn`] if that is not the latest state. Returns the number of free bytes.
    pub fn prune(
        &mut self,
        id: ExperimentId,
        n_generations: u64,
        keyframe: Option<&[u8]>,
        now_ms: u64,
    ) -> Result<u64> {
        self.write(|transaction, sealer| {
            let Some(found) = experiments::get(transaction, id)? else { return Ok(0) };
            if found.state.is_unfinished() {
                return Err(StoreError::Unfinished(id));
            }
            if found.n_generations() != n_generations {
                return Err(StoreError::WentOn(id));
            }
            if found.log_from >= n_generations {
                return Ok(0);
            }
            forks::check_unneeded(transaction, id, found.log_from)?;
            let n_deleted = fitness_log::delete(transaction, id)?;
            fitness_log::begin_at(transaction, id, n_generations, LogGap::Pruned)?;
            if let Some(state) = keyframe {
                let seal = sealer.keyframe(id, found.latest.as_ref(), state);
                fitness_log::put_keyframe(transaction, id, n_generations, state, seal)?;
            }
            add_notice(transaction, id, now_ms, "pruned: its fitness log is deleted")?;
            Ok(n_deleted.saturating_sub(keyframe.map_or(0, |state| state.len() as u64)))
        })
    }

    /// Reads one experiment, with its file.
    pub fn experiment(&self, id: ExperimentId) -> Result<Option<StoredExperiment>> {
        self.read(|connection| experiments::get(connection, id))
    }

    /// The data from which a generation is recomputed: the checkpoint before it, and its fitness;
    /// `None` if the log lacks it, or if a seal is broken.
    pub fn generation_in_log(
        &self,
        id: ExperimentId,
        generation: u64,
    ) -> Result<Option<(Checkpoint, GenerationRecord, Vec<u8>)>> {
        self.read(|connection| {
            let sealer = Some(&self.sealer);
            let checkpoint = fitness_log::checkpoint(connection, sealer, id, generation)?;
            let of = history::read_between(connection, id, generation, generation + 1)?.pop();
            let (Some(checkpoint), Some(of)) = (checkpoint, of) else { return Ok(None) };
            let told = fitness_log::told(connection, sealer, id, &of)?;
            Ok(told.map(|told| (checkpoint, of, told)))
        })
    }

    /// The fitness of at most `limit` complete generations from `from` on; `None` for one with a
    /// broken seal.
    pub fn fitness_log(
        &self,
        id: ExperimentId,
        from: u64,
        limit: u32,
    ) -> Result<Vec<Option<Vec<u8>>>> {
        self.read(|connection| {
            let end = from.saturating_add(limit.into());
            let history = history::read_between(connection, id, from, end)?;
            let told = |of| fitness_log::told(connection, Some(&self.sealer), id, of);
            Ok(history.iter().map(told).collect::<rusqlite::Result<_>>()?)
        })
    }

    /// The fitness log of the generations in `first..end`; `None` if a seal is broken.
    pub fn log_between(
        &self,
        id: ExperimentId,
        first: u64,
        end: u64,
    ) -> Result<Option<Vec<LogEntry>>> {
        self.read(|connection| {
            let mut log = Vec::new();
            for of in history::read_between(connection, id, first, end)? {
                let told = fitness_log::told(connection, Some(&self.sealer), id, &of)?;
                let Some(told) = told else { return Ok(None) };
                log.push((of, told));
            }
            Ok((log.len() as u64 == end - first).then_some(log))
        })
    }

    /// Reads the experiments that pass a filter, oldest first.
    pub fn experiments(&self, filter: &Filter) -> Result<Vec<ExperimentRecord>> {
        self.read(|connection| experiments::list(connection, filter))
    }

    /// The present champion; `None` before the first generation.
    pub fn champion(&self, id: ExperimentId) -> Result<Option<Champion>> {
        self.read(|connection| champions::get(connection, Some(&self.sealer), id))
    }

    /// Runs a query.
    fn read<T>(&self, query: impl FnOnce(&Connection) -> Result<T>) -> Result<T> {
        query(&self.connection).map_err(|error| error.at(&self.path))
    }

    /// Writes in one transaction, if this coordinator still owns the database.
    fn write<T>(
        &mut self,
        operation: impl FnOnce(&Transaction<'_>, &Sealer) -> Result<T>,
    ) -> Result<T> {
        let result = self.transact(operation).map_err(|error| error.at(&self.path))?;
        // The write is on disk anyway, and the next write tries again to fold the log.
        let _ = write_ahead_log::fold_if_long(&self.connection);
        Ok(result)
    }

    fn transact<T>(
        &mut self,
        operation: impl FnOnce(&Transaction<'_>, &Sealer) -> Result<T>,
    ) -> Result<T> {
        let Some(Ownership { owner: expected, .. }) = &self.ownership else {
            return Err(StoreError::ReadOnly { path: self.path.clone() });
        };
        let transaction =
            self.connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        if owner(&transaction)? != *expected {
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
    Ok((owner, Sealer::from_database(connection)?))
}

/// The token of the coordinator that owns a database.
fn owner(connection: &Connection) -> rusqlite::Result<Vec<u8>> {
    connection.prepare_cached("SELECT owner FROM identity")?.query_row([], |row| row.get(0))
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

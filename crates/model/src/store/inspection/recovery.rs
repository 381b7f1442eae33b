//! Makes a new data directory from the sound parts of a damaged one.

use std::path::Path;

use rusqlite::{Connection, Transaction, params};

use super::{
    super::{
        ExperimentState, GenerationRecord, LogGap, NewExperiment, Result, StoreError, add_notice,
        add_state_event, champions, configs, file, fitness_log, forks, history, quarantine, schema,
        seals::Sealer,
    },
    backup::{abandon, prepare},
    experiment::{EventRow, ExperimentRow, Fate, Inspected},
    log,
    source::Source,
};
use crate::{ids::ExperimentId, submission::Submission};

/// The reason of the pause of a restarted experiment.
const BEGINS_AGAIN: &str = "recovered from a damaged database without its generations: resume it to \
                            recompute them, to the same bits";

/// The outcome of a recovery.
#[derive(Debug)]
pub struct Recovery {
    /// All experiments, in order.
    pub experiments: Vec<Recovered>,
    /// The damage of the database as a whole.
    pub damage: Vec<String>,
}

/// The outcome for one experiment.
#[derive(Debug)]
pub struct Recovered {
    /// The experiment.
    pub id: ExperimentId,
    /// The parts in the new directory.
    pub fate: Fate,
    /// The damage, one line each.
    pub problems: Vec<String>,
}

/// Makes the data directory `to` from the sound parts of another one.
pub fn recover(directory: &Path, to: &Path) -> Result<Recovery> {
    let source = Source::open(&file::path_in(directory))?;
    let unfinished = prepare(to)?;
    let written = write_all(&source, &unfinished).and_then(|experiments| {
        let is_any_left = experiments.iter().any(|recovered| recovered.fate != Fate::Lost);
        if is_any_left || source.damage.is_empty() {
            return Ok(experiments);
        }
        Err(StoreError::NothingSound { path: file::path_in(directory) })
    });
    let experiments = match written {
        Ok(experiments) => experiments,
        Err(error) => {
            abandon(to);
            return Err(error);
        }
    };
    let failed = |source| StoreError::Target { path: to.to_owned(), source };
    file::publish(to).map_err(failed)?;
    Ok(Recovery { experiments, damage: source.damage })
}

fn write_all(source: &Source, path: &Path) -> Result<Vec<Recovered>> {
    let mut target = Connection::open(path)?;
    schema::migrate(&mut target)?;
    let transaction = target.transaction()?;
    let sealer = Sealer::from_database(&transaction)?;
    let mut experiments = Vec::new();
    for id in source.experiments() {
        let mut inspected = Inspected::read(source, id);
        transaction.execute_batch("SAVEPOINT experiment")?;
        let fate =
            write(&source.connection, &transaction, &sealer, &inspected).or_else(|error| {
                match error {
                    // The parts contradict each other.
                    StoreError::Bug(error) => {
                        transaction.execute_batch("ROLLBACK TO experiment")?;
                        inspected.problems.push(format!("it cannot be written: {error}"));
                        Ok(Fate::Lost)
                    }
                    error => Err(error),
                }
            })?;
        transaction.execute_batch("RELEASE experiment")?;
        experiments.push(Recovered { id, fate, problems: inspected.problems });
    }
    quarantine::copy(&source.connection, &transaction)?;
    // Ids are never used again, not even those of lost experiments.
    if let Some(Recovered { id, .. }) = experiments.last() {
        transaction.execute("DELETE FROM sqlite_sequence WHERE name = 'experiments'", [])?;
        let sql = "INSERT INTO sqlite_sequence VALUES ('experiments', ?1)";
        transaction.execute(sql, [id.0])?;
    }
    transaction.commit()?;
    target.close().map_err(|(_, error)| error)?;
    Ok(experiments)
}

/// Writes the sound parts of an experiment.
fn write(
    source: &Connection,
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    from: &Inspected,
) -> Result<Fate> {
    let Some(row) = &from.row else { return Ok(Fate::Lost) };
    match (from.fate(), &from.history, row.state) {
        (Fate::Kept, Some(history), Some(state)) => {
            write_whole(transaction, sealer, from, row, state, history)?;
            match from.log {
                Some(log) => log::copy(source, transaction, sealer, from.id, log, history)?,
                None => {
                    let gap = row.log_gap.unwrap_or(LogGap::Damaged);
                    let gap = if gap == LogGap::None { LogGap::Damaged } else { gap };
                    let n_generations = history.len() as u64;
                    fitness_log::begin_at(transaction, from.id, n_generations, gap)?;
                }
            }
            Ok(Fate::Kept)
        }
        (Fate::Lost, ..) => Ok(Fate::Lost),
        _ => match beginning(row) {
            Some(new) => {
                write_beginning(transaction, sealer, from.id, row, &new)?;
                Ok(Fate::Restarted)
            }
            None => Ok(Fate::Lost),
        },
    }
}

fn write_whole(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    from: &Inspected,
    row: &ExperimentRow,
    state: ExperimentState,
    history: &[GenerationRecord],
) -> Result<()> {
    let id = from.id;
    write_row(transaction, sealer, id, row, (state, &row.reason, &row.digest))?;
    for generation in history {
        history::put(transaction, sealer, id, generation)?;
    }
    if let Some(fork) = &row.fork {
        forks::put(transaction, sealer, id, fork)?;
    }
    if let Some(Some(champion)) = &from.champion {
        let latest = history.last().map(|latest| latest.generation);
        champions::put(transaction, sealer, id, champion, latest, &row.digest)?;
    }
    match &from.events {
        Some(events) => write_events(transaction, id, events)?,
        None => {
            let at_ms = row.submitted_at_ms;
            add_state_event(transaction, id, at_ms, ExperimentState::Running, "submitted")?;
            let generations = history.iter().map(|generation| EventRow {
                sequence: generation.generation + 2,
                at_ms,
                kind: "generation".to_owned(),
                generation: Some(generation.generation),
                state: None,
                message: None,
            });
            write_events(transaction, id, &generations.collect::<Vec<_>>())?;
            if state != ExperimentState::Running {
                add_state_event(transaction, id, at_ms, state, &row.reason)?;
            }
        }
    }
    Ok(())
}

/// An experiment before its first generation, if this program can compute it.
fn beginning(row: &ExperimentRow) -> Option<NewExperiment> {
    let config_json = row.config.clone();
    let checked = Submission { config_json, ..Submission::default() }.check(&|| true).ok()?;
    (checked.new.config_digest.to_string() == row.config_digest).then_some(checked.new)
}

fn write_beginning(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    row: &ExperimentRow,
    new: &NewExperiment,
) -> Result<()> {
    let paused = ExperimentState::Paused;
    write_row(transaction, sealer, id, row, (paused, BEGINS_AGAIN, ""))?;
    let seal = sealer.keyframe(id, None, &new.keyframe);
    fitness_log::put_keyframe(transaction, id, 0, &new.keyframe, seal)?;
    let at_ms = row.submitted_at_ms;
    add_state_event(transaction, id, at_ms, ExperimentState::Running, "submitted")?;
    add_notice(transaction, id, at_ms, BEGINS_AGAIN)?;
    add_state_event(transaction, id, at_ms, paused, BEGINS_AGAIN)?;
    Ok(())
}

/// Writes an experiment's row, with its state, the reason for it, and the digest of
/// everything so far.
fn write_row(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    row: &ExperimentRow,
    (state, reason, digest): (ExperimentState, &str, &str),
) -> Result<()> {
    transaction.execute(
        "INSERT INTO experiments (id, request_id, name, config_digest, fingerprint, genotype_len,
                                  state, reason, submitted_at_ms, digest, priority, group_name,
                                  variant, labels, archived)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14,
                 ?15 AND ?7 NOT IN ('running', 'paused'))",
        params![
            id.0,
            row.request_id,
            row.name,
            row.config_digest,
            row.fingerprint,
            row.genotype_len,
            state.name(),
            reason,
            row.submitted_at_ms,
            digest,
            row.priority,
            row.group,
            row.variant,
            row.labels,
            row.is_archived,
        ],
    )?;
    Ok(configs::put(transaction, sealer, id, &row.config)?)
}

fn write_events(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    events: &[EventRow],
) -> Result<()> {
    let mut statement =
        transaction.prepare_cached("INSERT INTO events VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")?;
    for event in events {
        statement.execute(params![
            id.0,
            event.sequence,
            event.at_ms,
            event.kind,
            event.generation,
            event.state,
            event.message
        ])?;
    }
    Ok(())
}

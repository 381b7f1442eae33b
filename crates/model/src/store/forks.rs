//! The table of forks.

use rusqlite::{Connection, OptionalExtension as _, Row, Transaction, params};

use super::{
    ForkRecord, GenerationRecord, LogGap, Result, StoreError, fitness_log, history,
    seals::{Seal, Sealer},
};
use crate::ids::ExperimentId;

/// Checks that no fork shares a generation from `first` on with an experiment.
pub fn check_unneeded(connection: &Connection, id: ExperimentId, first: u64) -> Result<()> {
    let mut statement = connection.prepare_cached(
        "SELECT experiment_id FROM forks WHERE parent_id = ?1 AND generation >= ?2
         ORDER BY experiment_id DESC",
    )?;
    let forks = statement.query_map(params![id.0, first], |row| row.get(0).map(ExperimentId))?;
    let forks: Vec<ExperimentId> = forks.collect::<rusqlite::Result<_>>()?;
    if forks.is_empty() { Ok(()) } else { Err(StoreError::NeededByForks { id, forks }) }
}

/// Adds the origin of a fork.
pub fn put(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    fork: &ForkRecord,
) -> rusqlite::Result<()> {
    let changes = serde_json::to_string(&fork.changes).expect("text serialises");
    let seal = seal_of(sealer, id, fork, &changes);
    transaction.execute(
        "INSERT INTO forks (experiment_id, parent_id, generation, link, changes, seal)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
        params![id.0, fork.parent.0, fork.generation, fork.link, changes, seal],
    )?;
    Ok(())
}

/// Copies to a new fork the history that it shares with its parent, with the times of completion.
/// Returns the last shared generation.
pub fn copy_history(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    fork: &ForkRecord,
) -> Result<GenerationRecord> {
    let n_shared = fork.generation + 1;
    let mut shared = history::read_between(transaction, fork.parent, 0, n_shared)?;
    // The parent may have been deleted during the check of its fork.
    if shared.len() as u64 != n_shared {
        return Err(StoreError::ParentGone(fork.parent));
    }
    for generation in &shared {
        history::put(transaction, sealer, id, generation)?;
    }
    transaction.execute(
        "INSERT INTO events (experiment_id, sequence, at_ms, kind, generation)
         SELECT ?1, (SELECT max(sequence) FROM events WHERE experiment_id = ?1) + 1 + generation,
                at_ms, kind, generation
         FROM events WHERE experiment_id = ?2 AND kind = 'generation' AND generation <= ?3",
        params![id.0, fork.parent.0, fork.generation],
    )?;
    fitness_log::begin_at(transaction, id, n_shared, LogGap::Forked)?;
    Ok(shared.pop().expect("at least generation 0 is shared"))
}

/// The origin of an experiment, if it is a fork; a broken seal is damage. `sealer`: `None` if the
/// database has no seals yet.
pub fn get(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
) -> Result<Option<ForkRecord>> {
    let mut statement = connection.prepare_cached(
        "SELECT parent_id, generation, link, changes, seal FROM forks WHERE experiment_id = ?1",
    )?;
    let read = |row: &Row<'_>| {
        let text: String = row.get(3)?;
        let changes: Option<Vec<String>> = serde_json::from_str(&text).ok();
        let fork = ForkRecord {
            parent: ExperimentId(row.get(0)?),
            generation: row.get(1)?,
            link: row.get(2)?,
            changes: changes.clone().unwrap_or_default(),
        };
        let seal: Vec<u8> = row.get(4)?;
        let is_sound = changes.is_some()
            && sealer.is_none_or(|sealer| seal == seal_of(sealer, id, &fork, &text));
        Ok(is_sound.then_some(fork))
    };
    match statement.query_row([id.0], read).optional()? {
        Some(None) => {
            let what = format!("the origin of experiment {id} is not what was stored");
            Err(StoreError::Corrupt(what))
        }
        Some(fork) => Ok(fork),
        None => Ok(None),
    }
}

fn seal_of(sealer: &Sealer, id: ExperimentId, fork: &ForkRecord, changes: &str) -> Seal {
    let ForkRecord { parent, generation, link, .. } = fork;
    let seal = sealer.begin("fork", id).number(parent.0).number(*generation);
    seal.text(link.as_bytes()).text(changes.as_bytes()).finish()
}

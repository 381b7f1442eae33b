//! The tables of checkpoints and of the steps since.

use evolution::{Advance, Checkpoint};
use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{
    ExperimentState, GenerationRecord,
    seals::{Seal, Sealer},
};
use crate::ids::ExperimentId;

/// A checkpoint as it is stored, damaged or not.
pub struct Stored {
    state: Sealed,
    /// With the generations that they are of, in order.
    steps: Vec<(u64, Sealed)>,
}

/// Bytes and their seal.
struct Sealed {
    seal: Vec<u8>,
    bytes: Vec<u8>,
}

impl Stored {
    /// Generations since the state.
    pub fn n_steps(&self) -> usize {
        self.steps.len()
    }

    /// The checkpoint, if it is what was stored. `history`: the latest generations, of them
    /// at least one more than there are steps if there are so many; `sealer`: none if the
    /// database has no seals yet.
    pub fn check(
        self,
        sealer: Option<&Sealer>,
        id: ExperimentId,
        history: &[GenerationRecord],
    ) -> Option<Checkpoint> {
        let Self { state, steps } = self;
        let (before, since) = history.split_at_checked(history.len().checked_sub(steps.len())?)?;
        let are_in_place = since.iter().zip(&steps).all(|(of, (at, _))| of.generation == *at);
        let is_sound = sealer.is_none_or(|sealer| {
            state.seal == sealer.checkpoint(id, before.last(), &state.bytes)
                && (since.iter().zip(&steps))
                    .all(|(of, (_, step))| step.seal == sealer.step(id, of, &step.bytes))
        });
        let steps = steps.into_iter().map(|(_, step)| step.bytes).collect();
        (are_in_place && is_sound).then_some(Checkpoint { state: state.bytes, steps })
    }
}

/// Adds to an experiment's checkpoint, or replaces it. `seal`: of the bytes.
pub fn advance(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    generation: u64,
    advance: &Advance,
    seal: Seal,
) -> rusqlite::Result<()> {
    match advance {
        Advance::State(state) => put(transaction, id, state, seal),
        Advance::Step(step) => add_step(transaction, id, generation, step, seal),
    }
}

/// Replaces an experiment's checkpoint by a state.
pub fn put(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    state: &[u8],
    seal: Seal,
) -> rusqlite::Result<()> {
    transaction
        .prepare_cached("DELETE FROM checkpoint_steps WHERE experiment_id = ?1")?
        .execute([id.0])?;
    let mut statement = transaction.prepare_cached(
        "INSERT INTO checkpoints (experiment_id, state, seal) VALUES (?1, ?2, ?3)
         ON CONFLICT (experiment_id) DO UPDATE SET state = ?2, seal = ?3",
    )?;
    statement.execute(params![id.0, state, seal])?;
    Ok(())
}

/// Adds a step to an experiment's checkpoint.
pub fn add_step(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    generation: u64,
    step: &[u8],
    seal: Seal,
) -> rusqlite::Result<()> {
    transaction
        .prepare_cached("INSERT INTO checkpoint_steps VALUES (?1, ?2, ?3, ?4)")?
        .execute(params![id.0, generation, step, seal])?;
    Ok(())
}

/// Reads an experiment's checkpoint.
pub fn get(connection: &Connection, id: ExperimentId) -> rusqlite::Result<Option<Stored>> {
    let Some(state) = get_state(connection, id)? else { return Ok(None) };
    let mut statement = connection.prepare_cached(
        "SELECT generation, seal, step FROM checkpoint_steps
         WHERE experiment_id = ?1 ORDER BY generation",
    )?;
    let read = |row: &rusqlite::Row<'_>| {
        Ok((row.get(0)?, Sealed { seal: row.get(1)?, bytes: row.get(2)? }))
    };
    let steps = statement.query_map([id.0], read)?.collect::<rusqlite::Result<_>>()?;
    Ok(Some(Stored { state, steps }))
}

fn get_state(connection: &Connection, id: ExperimentId) -> rusqlite::Result<Option<Sealed>> {
    let mut statement = connection
        .prepare_cached("SELECT seal, state FROM checkpoints WHERE experiment_id = ?1")?;
    // Text in older databases.
    let read = |row: &rusqlite::Row<'_>| {
        Ok(Sealed { seal: row.get(0)?, bytes: row.get_ref(1)?.as_bytes()?.to_vec() })
    };
    statement.query_row([id.0], read).optional()
}

/// Seals an experiment's state as it is stored, in a database that has no steps yet.
/// `latest`: the generation that it follows.
pub fn seal(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    latest: Option<&GenerationRecord>,
) -> rusqlite::Result<()> {
    if let Some(state) = get_state(transaction, id)? {
        let seal = sealer.checkpoint(id, latest, &state.bytes);
        let sql = "UPDATE checkpoints SET seal = ?2 WHERE experiment_id = ?1";
        transaction.execute(sql, params![id.0, seal])?;
    }
    Ok(())
}

/// Deletes the checkpoint of an experiment that has ended in a way after which nothing
/// can continue from it. Its pages are used again.
pub fn delete_unless_of_use(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    state: ExperimentState,
    reason: &str,
) -> rusqlite::Result<()> {
    // Only one that has run out of generations can be given more.
    let is_of_use =
        state.is_unfinished() || (state == ExperimentState::Completed && reason.is_empty());
    if !is_of_use {
        for table in ["checkpoints", "checkpoint_steps"] {
            let sql = format!("DELETE FROM {table} WHERE experiment_id = ?1");
            transaction.execute(&sql, [id.0])?;
        }
    }
    Ok(())
}

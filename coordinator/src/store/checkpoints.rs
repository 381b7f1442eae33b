//! The table of checkpoints.

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{
    ExperimentState, GenerationRecord,
    seals::{Seal, Sealer},
};
use crate::ids::ExperimentId;

/// A checkpoint as it is stored, damaged or not.
pub struct Stored {
    /// Its seal.
    pub seal: Vec<u8>,
    /// Evolution, as JSON.
    pub state: Vec<u8>,
}

/// Replaces an experiment's checkpoint.
pub fn put(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    state: &str,
    seal: Seal,
) -> rusqlite::Result<()> {
    let mut statement = transaction.prepare_cached(
        "INSERT INTO checkpoints (experiment_id, state, seal) VALUES (?1, ?2, ?3)
         ON CONFLICT (experiment_id) DO UPDATE SET state = ?2, seal = ?3",
    )?;
    statement.execute(params![id.0, state, seal])?;
    Ok(())
}

/// Reads an experiment's checkpoint.
pub fn get(connection: &Connection, id: ExperimentId) -> rusqlite::Result<Option<Stored>> {
    let mut statement = connection
        .prepare_cached("SELECT seal, state FROM checkpoints WHERE experiment_id = ?1")?;
    let read = |row: &rusqlite::Row<'_>| {
        Ok(Stored { seal: row.get(0)?, state: row.get_ref(1)?.as_bytes()?.to_vec() })
    };
    statement.query_row([id.0], read).optional()
}

/// Seals an experiment's checkpoint as it is stored. `latest`: the generation that it
/// follows.
pub fn seal(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    latest: Option<&GenerationRecord>,
) -> rusqlite::Result<()> {
    if let Some(Stored { state, .. }) = get(transaction, id)? {
        let seal = sealer.checkpoint(id, latest, &state);
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
        transaction.execute("DELETE FROM checkpoints WHERE experiment_id = ?1", [id.0])?;
    }
    Ok(())
}

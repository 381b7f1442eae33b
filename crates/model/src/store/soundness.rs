//! Reads the state from which a run continues, and checks its seals.

use evolution::Checkpoint;
use rusqlite::{Connection, params};

use super::{
    ExperimentState, Result, Store, StoreError, StoredExperiment, add_notice, add_state_event,
    experiments, fitness_log, forks, sealing, seals::Sealer,
};
use crate::ids::ExperimentId;

impl Store {
    /// An experiment and its checkpoint, both with intact seals. Fails with
    /// [`StoreError::Unsound`] if a seal is broken, and with [`StoreError::NoCheckpoint`] if the
    /// experiment has ended without a checkpoint.
    pub fn resumable(&self, id: ExperimentId) -> Result<(StoredExperiment, Checkpoint)> {
        self.read(|connection| {
            let what = match resumable(connection, &self.sealer, id)? {
                Ok(found) => return Ok(found),
                Err(what) => what,
            };
            // Missing data is not damage if none was kept.
            match experiments::get(connection, id) {
                Ok(Some(ended)) if ended.has_no_log() => Err(StoreError::NoCheckpoint(id)),
                _ => Err(self.unsound(id, what)),
            }
        })
    }

    /// The error of a run that cannot continue from the stored state.
    pub fn unsound(&self, id: ExperimentId, what: String) -> StoreError {
        StoreError::Unsound { id, what, path: self.path.clone() }
    }

    /// Pauses an experiment from which no run can continue, and adds the reason to its events. It
    /// changes nothing else, so that nothing is lost. A repaired experiment can be resumed.
    pub fn set_aside(&mut self, id: ExperimentId, now_ms: u64, reason: &str) -> Result<()> {
        let paused = ExperimentState::Paused;
        self.write(|transaction, _| {
            let n_changed = transaction.execute(
                "UPDATE experiments SET state = ?2, reason = ?3
                 WHERE id = ?1 AND state IN ('running', 'paused') AND reason <> ?3",
                params![id.0, paused.name(), reason],
            )?;
            if n_changed > 0 {
                add_notice(transaction, id, now_ms, reason)?;
                add_state_event(transaction, id, now_ms, paused, reason)?;
            }
            Ok(())
        })
    }
}

/// An experiment and its checkpoint, or the part with a broken seal. Both the coordinator and
/// inspections use this verdict.
pub fn resumable(
    connection: &Connection,
    sealer: &Sealer,
    id: ExperimentId,
) -> Result<Result<(StoredExperiment, Checkpoint), String>> {
    let found = match experiments::get(connection, id) {
        Err(StoreError::Corrupt(what)) => return Ok(Err(what)),
        other => other?,
    };
    let Some(found) = found else { return Ok(Err("it does not exist".to_owned())) };
    let (seal, expected) = sealing::experiment_seal(connection, sealer, id)?;
    if seal != expected {
        return Ok(Err("its configuration is not what was stored".to_owned()));
    }
    // Checks the seal of the fork's row.
    if let Err(StoreError::Corrupt(what)) = forks::get(connection, Some(sealer), id) {
        return Ok(Err(what));
    }
    let n_generations = found.latest.as_ref().map_or(0, |latest| latest.generation + 1);
    let is_whole = fitness_log::ends_at(connection, id, n_generations)?;
    let checkpoint = fitness_log::checkpoint(connection, Some(sealer), id, n_generations)?;
    Ok(match checkpoint.filter(|_| is_whole) {
        Some(checkpoint) => Ok((found, checkpoint)),
        None => Err("its checkpoint, or the end of its history, is not what was stored".to_owned()),
    })
}

#[cfg(test)]
mod tests;

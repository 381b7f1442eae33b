//! What a run continues from, and whether it is what was stored.

use evolution::Checkpoint;
use rusqlite::params;

use super::{
    ExperimentRecord, ExperimentState, Result, Store, StoreError, add_notice, add_state_event,
    experiments, fitness_log, forks, seals,
};
use crate::ids::ExperimentId;

impl Store {
    /// An experiment and its checkpoint, both as they were stored;
    /// [`StoreError::Unsound`] if one of them is not.
    pub fn resumable(&self, id: ExperimentId) -> Result<(ExperimentRecord, Checkpoint)> {
        self.read(|connection| {
            let unsound = |what: &str| self.unsound(id, what.to_owned());
            let found = match experiments::get(connection, id) {
                Err(StoreError::Corrupt(what)) => return Err(self.unsound(id, what)),
                other => other?.ok_or_else(|| unsound("it is not there"))?,
            };
            let (seal, expected) = seals::experiment_seal(connection, &self.sealer, id)?;
            if seal != expected {
                return Err(unsound("its configuration is not what was stored"));
            }
            // Its seal.
            if let Err(StoreError::Corrupt(what)) = forks::get(connection, Some(&self.sealer), id) {
                return Err(unsound(&what));
            }
            let n_generations = found.latest.as_ref().map_or(0, |latest| latest.generation + 1);
            let sealer = Some(&self.sealer);
            let is_whole = fitness_log::ends_at(connection, id, n_generations)?;
            let checkpoint = fitness_log::checkpoint(connection, sealer, id, n_generations)?
                .filter(|_| is_whole)
                .ok_or_else(|| {
                    unsound("its checkpoint, or the end of its history, is not what was stored")
                })?;
            Ok((found, checkpoint))
        })
    }

    /// The error that a run cannot continue from what is stored.
    pub fn unsound(&self, id: ExperimentId, what: String) -> StoreError {
        StoreError::Unsound { id, what, path: self.path.clone() }
    }

    /// Pauses an experiment from which no run can continue, and says why among its
    /// events; nothing else of it is changed, so that nothing is lost. Once it is sound
    /// again, it can be resumed.
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

#[cfg(test)]
mod tests;

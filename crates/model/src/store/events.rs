//! Changes of state and notices, as rows among an experiment's events.

use rusqlite::{Transaction, params};

use super::ExperimentState;
use crate::ids::ExperimentId;

/// Changes the state of an unfinished experiment, or the reason of a pause, and adds an event.
pub fn set_state(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    now_ms: u64,
    state: ExperimentState,
    reason: &str,
) -> rusqlite::Result<()> {
    let n_changed = transaction.execute(
        "UPDATE experiments SET state = ?2, reason = ?3
         WHERE id = ?1 AND state IN ('running', 'paused')
           AND (state <> ?2 OR ?2 = 'paused' AND reason <> ?3)",
        params![id.0, state.name(), reason],
    )?;
    if n_changed > 0 {
        add_state_event(transaction, id, now_ms, state, reason)?;
    }
    Ok(())
}

/// Adds a change of state to an experiment's events.
pub fn add_state_event(
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

/// Adds a notice to an experiment's events.
pub fn add_notice(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    now_ms: u64,
    text: &str,
) -> rusqlite::Result<()> {
    // A deleted experiment gets no notices.
    transaction.execute(
        "INSERT INTO events (experiment_id, sequence, at_ms, kind, message)
         SELECT ?1, (SELECT ifnull(max(sequence), 0) + 1 FROM events WHERE experiment_id = ?1),
                ?2, 'notice', ?3
         WHERE EXISTS (SELECT 1 FROM experiments WHERE id = ?1)",
        params![id.0, now_ms, text],
    )?;
    Ok(())
}

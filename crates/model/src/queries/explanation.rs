//! The store's part of an explanation.

use crate::store::{Event, EventKind, ExperimentRecord, Store};

use super::QueryError;

/// Number of latest events to search for notices.
const EVENTS_MAX: u32 = 100;
/// Most notices to show.
const NOTICES_MAX: usize = 10;

/// The latest notices among an experiment's events, oldest first.
pub fn latest_notices(
    store: &Store,
    experiment: &ExperimentRecord,
) -> Result<Vec<Event>, QueryError> {
    let from_sequence = (experiment.last_sequence + 1).saturating_sub(EVENTS_MAX.into());
    let mut notices = store.events(experiment.id, from_sequence, EVENTS_MAX)?;
    notices.retain(|event| matches!(event.kind, EventKind::Notice(_)));
    Ok(notices.split_off(notices.len().saturating_sub(NOTICES_MAX)))
}

/// Why this program cannot compute an experiment, if it cannot.
pub fn incompatibility(experiment: &ExperimentRecord) -> Option<String> {
    let (theirs, ours) = (&experiment.fingerprint, sim_core::FINGERPRINT);
    (theirs != ours)
        .then(|| format!("it was started with \"{theirs}\", this coordinator is \"{ours}\""))
}

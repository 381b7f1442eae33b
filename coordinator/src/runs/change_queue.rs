//! What clients and the engine change about experiments, on its way to the store:
//! for each experiment one write at a time, in the order in which things happened.

use std::collections::{BTreeMap, VecDeque};

use crate::{
    ids::ExperimentId,
    priority::Priority,
    store::{ExperimentState, Store, StoreError},
};

use super::RequestId;

/// Writes under way and those that wait. As long as the requests that lead to them:
/// each client waits for its own.
#[derive(Debug, Default)]
pub struct ChangeQueue {
    /// Per experiment, none empty; the first is being written.
    pending: BTreeMap<ExperimentId, VecDeque<PendingChange>>,
}

/// A change that is not stored yet.
#[derive(Debug)]
pub struct PendingChange {
    /// Of which experiment.
    pub experiment: ExperimentId,
    /// What to write.
    pub change: Change,
    /// The requests to answer when it is written.
    pub requests: Vec<RequestId>,
}

/// What a client may want of an unfinished experiment.
#[derive(Debug, Clone)]
pub enum Request {
    /// That it ends.
    Cancel,
    /// That it waits to be resumed; the text says why.
    Pause(String),
    /// That it goes on.
    Resume,
    /// That its share of the fleet is another.
    SetPriority(Priority),
    /// Nothing but an answer, once everything that was wanted before is stored.
    Settle,
}

/// A change of an unfinished experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    /// Another state, and why.
    State(ExperimentState, String),
    /// Another share of the fleet.
    Priority(Priority),
    /// A line among its events.
    Notice(String),
}

impl ChangeQueue {
    /// Adds a change after all others of its experiment; returns it if it is to be
    /// written at once.
    pub fn push(&mut self, pending: PendingChange) -> Option<Change> {
        let queue = self.pending.entry(pending.experiment).or_default();
        let change = queue.is_empty().then(|| pending.change.clone());
        queue.push_back(pending);
        change
    }

    /// Has a request answered when the last change so far of an experiment is written;
    /// false if there is none.
    pub fn join(&mut self, id: ExperimentId, request: RequestId) -> bool {
        let last = self.pending.get_mut(&id).and_then(VecDeque::back_mut);
        last.map(|last| last.requests.push(request)).is_some()
    }

    /// The changes of an experiment that are not known to be stored, in order.
    pub fn pending(&self, id: ExperimentId) -> impl Iterator<Item = &Change> {
        self.pending.get(&id).into_iter().flatten().map(|pending| &pending.change)
    }

    /// The first change of an experiment has been written. Returns the requests that
    /// waited for it, and the change to write next.
    pub fn on_written(&mut self, id: ExperimentId) -> (Vec<RequestId>, Option<Change>) {
        let Some(queue) = self.pending.get_mut(&id) else { return (Vec::new(), None) };
        let requests = queue.pop_front().map(|written| written.requests).unwrap_or_default();
        let next = queue.front().map(|next| next.change.clone());
        if next.is_none() {
            self.pending.remove(&id);
        }
        (requests, next)
    }
}

impl Change {
    /// What it is called in the log.
    pub fn name(&self) -> &'static str {
        match self {
            Self::State(ExperimentState::Running, _) => "resumption",
            Self::State(ExperimentState::Paused, _) => "pause",
            Self::State(..) => "end",
            Self::Priority(_) => "priority",
            Self::Notice(_) => "alarm",
        }
    }

    /// Writes it. `now_ms`: milliseconds since 1970 UTC.
    pub fn write(
        &self,
        store: &mut Store,
        id: ExperimentId,
        now_ms: u64,
    ) -> Result<(), StoreError> {
        match self {
            Self::State(state, reason) => store.set_state(id, now_ms, *state, reason),
            Self::Priority(priority) => store.set_priority(id, *priority),
            Self::Notice(text) => store.notice(id, now_ms, text),
        }
    }
}

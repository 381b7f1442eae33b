//! Changes of experiments by clients and the engine, on their way to the store: one write at a
//! time per experiment, in the order of the changes.

use std::collections::{BTreeMap, VecDeque};

use crate::{
    ids::ExperimentId,
    priority::Priority,
    store::{ExperimentState, Store, StoreError},
};

/// Changes that are being written or wait. The number of requests bounds them, because each client
/// waits for its own change.
#[derive(Debug, Default)]
pub struct ChangeQueue {
    /// A queue per experiment, none empty; the first change is being written.
    pending: BTreeMap<ExperimentId, VecDeque<PendingChange>>,
}

/// A change that is not stored yet.
#[derive(Debug)]
pub struct PendingChange {
    /// The experiment.
    pub experiment: ExperimentId,
    /// The change.
    pub change: Change,
    /// The requests to answer after the write.
    pub requests: Vec<RequestId>,
}

/// A client's request to change an unfinished experiment.
#[derive(Debug, Clone)]
pub enum Request {
    /// End it.
    Cancel,
    /// Pause it until a client resumes it; the text says why.
    Pause(String),
    /// Resume it.
    Resume,
    /// Change its priority.
    SetPriority(Priority),
    /// Change nothing; answer once all earlier changes are stored.
    Settle,
}

/// A client's request that waits for an answer; the caller chooses the id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId(pub u64);

/// A change of an unfinished experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Change {
    /// A new state, and its reason.
    State(ExperimentState, String),
    /// A new priority.
    Priority(Priority),
    /// A notice among its events.
    Notice(String),
}

impl ChangeQueue {
    /// Adds a change after all others of its experiment; returns it if the caller should write it
    /// now.
    pub fn push(&mut self, pending: PendingChange) -> Option<Change> {
        let queue = self.pending.entry(pending.experiment).or_default();
        let change = queue.is_empty().then(|| pending.change.clone());
        queue.push_back(pending);
        change
    }

    /// Lets a request wait for the last pending change of an experiment; false if no change is
    /// pending.
    pub fn join(&mut self, id: ExperimentId, request: RequestId) -> bool {
        let last = self.pending.get_mut(&id).and_then(VecDeque::back_mut);
        last.map(|last| last.requests.push(request)).is_some()
    }

    /// The pending changes of an experiment, in order.
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
    /// Its name in the log.
    pub fn name(&self) -> &'static str {
        match self {
            Self::State(ExperimentState::Running, _) => "resumption",
            Self::State(ExperimentState::Paused, _) => "pause",
            Self::State(..) => "end",
            Self::Priority(_) => "priority",
            Self::Notice(_) => "alarm",
        }
    }

    /// Writes the change to the store. `now_ms`: milliseconds since 1970 UTC.
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

//! What clients and the engine change about experiments, on its way to the store:
//! for each experiment one write at a time, in the order in which things happened.

use std::collections::{BTreeMap, VecDeque};

use tokio::{sync::oneshot, task::JoinSet};
use tokio_util::sync::CancellationToken;

use crate::{
    clock, failpoint,
    ids::ExperimentId,
    priority::Priority,
    shared_store::{Retry, SharedStore, Written},
    store::{ExperimentState, Store, StoreError},
};

/// Writes that wait, and those that are under way. As long as the events that
/// lead to them: each client waits for its own.
pub struct Ledger {
    store: SharedStore,
    shutdown: CancellationToken,
    /// What waits for the write of the same experiment that is under way.
    waiting: BTreeMap<ExperimentId, VecDeque<Entry>>,
    writing: JoinSet<ExperimentId>,
}

/// Something to write, and who waits for it.
pub struct Entry {
    pub experiment: ExperimentId,
    pub change: Change,
    /// Answered when it is written; dropped if it is not to be.
    pub replies: Vec<oneshot::Sender<()>>,
}

/// A change of an unfinished experiment.
#[derive(Debug, Clone)]
pub enum Change {
    /// The state and why.
    State(ExperimentState, String),
    Priority(Priority),
    /// A line among its events.
    Notice(String),
}

impl Ledger {
    /// An empty ledger.
    pub fn new(store: SharedStore, shutdown: CancellationToken) -> Self {
        Self { store, shutdown, waiting: BTreeMap::new(), writing: JoinSet::new() }
    }

    /// Writes something after all that came before it.
    pub fn push(&mut self, entry: Entry) {
        match self.waiting.get_mut(&entry.experiment) {
            Some(waiting) => waiting.push_back(entry),
            None => {
                self.waiting.insert(entry.experiment, VecDeque::new());
                self.write(entry);
            }
        }
    }

    /// Waits for a write that is under way and begins the next; none if there is
    /// nothing to wait for. Dropping the future loses nothing.
    pub async fn advance(&mut self) -> Option<()> {
        let id = match self.writing.join_next().await? {
            Ok(id) => id,
            // Whoever waits for it would wait for ever. At the next start its
            // experiment is as it was before.
            Err(error) => panic!("storing a change: {error}"),
        };
        match self.waiting.get_mut(&id).and_then(VecDeque::pop_front) {
            Some(next) => self.write(next),
            None => drop(self.waiting.remove(&id)),
        }
        Some(())
    }

    fn write(&mut self, Entry { experiment: id, change, replies }: Entry) {
        let (store, shutdown) = (self.store.clone(), self.shutdown.clone());
        let now_ms = clock::unix_ms();
        self.writing.spawn(async move {
            failpoint::reached("before change");
            let what = format!("the {} of experiment {id}", change.name());
            // If the coordinator stops before it is written, the experiment is at the
            // next start as it was before, and can be changed again.
            let written = store
                .write(&shutdown, &what, Retry::Always, move |store| {
                    change.write(store, id, now_ms)
                })
                .await;
            if matches!(written, Written::Yes) {
                failpoint::reached("changed");
                for reply in replies {
                    // Whoever has stopped waiting need not be told.
                    let _ = reply.send(());
                }
            }
            id
        });
    }
}

impl Change {
    /// What it is, for the log.
    fn name(&self) -> &'static str {
        match self {
            Self::State(ExperimentState::Running, _) => "resumption",
            Self::State(ExperimentState::Paused, _) => "pause",
            Self::State(..) => "end",
            Self::Priority(_) => "priority",
            Self::Notice(_) => "alarm",
        }
    }

    fn write(&self, store: &mut Store, id: ExperimentId, now_ms: u64) -> Result<(), StoreError> {
        match self {
            Self::State(state, reason) => store.set_state(id, now_ms, *state, reason),
            Self::Priority(priority) => store.set_priority(id, *priority),
            Self::Notice(text) => store.notice(id, now_ms, text),
        }
    }
}

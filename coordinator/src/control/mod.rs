//! The operations that a running coordinator offers to clients: submit and steer experiments,
//! evaluate genotypes, report the fleet's activity.
//!
//! It works on core types. Calls that only read are in [`queries`].

mod capacity;
mod evaluate;
mod experiment_files;
mod explain;
mod fitness;
mod follow;
mod import;
mod keep;
mod placement;
mod readmit;
mod reopen;
mod requests;
mod restart;
mod steer;
mod submit;
mod turns;
mod watch;

use std::{
    collections::BTreeSet,
    sync::{Arc, Mutex},
};

use experiment_file::ConfigError;
use tokio::sync::{Semaphore, oneshot};
use tokio_util::sync::CancellationToken;

use engine::{EvaluationActivity, TimelineEntry, WorkerStatus};

use crate::{
    driver::{DriverEvent, EventSender},
    ids::ExperimentId,
    limits::{EVALUATIONS_MAX, REQUESTS_LEN_MAX, UNFINISHED_MAX},
    memory::Shortage,
    queries::{self, QueryError},
    shared_store::SharedStore,
    store::{ExperimentRecord, Store, StoreError},
};

use experiment_files::ExperimentFiles;
use requests::Requests;

pub use evaluate::{CheckedEvaluation, EvaluationOrder};
pub use explain::Explanation;
pub use fitness::FitnessOrder;
pub use follow::{WatchError, follow};
pub use placement::{Existing, Placement, place};
pub use reopen::Reopening;
pub use submit::Submitted;
pub use turns::Client;

/// A handle to a running coordinator.
#[derive(Debug, Clone)]
pub struct Control {
    events: EventSender,
    store: SharedStore,
    /// Bytes of memory for all unfinished experiments together.
    memory_budget: u64,
    requests: Requests,
    /// The client that calls.
    client: Client,
    experiment_files: Arc<ExperimentFiles>,
    /// One permit for each evaluation in progress.
    evaluations: Arc<Semaphore>,
    /// Damaged unfinished experiments, which the driver does not know.
    set_aside: Arc<Mutex<BTreeSet<ExperimentId>>>,
    /// Unfinished experiments that no client has requested yet, so that the driver does not know
    /// them.
    left_alone: Arc<Mutex<BTreeSet<ExperimentId>>>,
}

/// Why an operation failed.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// The client's mistake.
    #[error("{0}")]
    Invalid(String),
    /// The experiment file has mistakes.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The limit of unfinished experiments is reached.
    #[error("{UNFINISHED_MAX} experiments are unfinished already; wait, or cancel some")]
    TooManyUnfinished,
    /// The limit of memory for requests is reached.
    #[error(
        "requests in progress have {} MiB of experiment files and genotypes, as much as the \
         coordinator accepts; try again when some are done",
        REQUESTS_LEN_MAX >> 20
    )]
    TooManyRequests,
    /// The state of the experiment does not allow the operation; the text says what to do
    /// instead.
    #[error("{0}")]
    NotNow(String),
    /// There is no memory for another experiment.
    #[error("{0}")]
    NoMemory(Shortage),
    /// The database did not store a change in time; the coordinator keeps trying.
    #[error(
        "the database did not store the change of experiment {0} in time; the coordinator tries \
         again, and its log says why"
    )]
    NotStoredYet(ExperimentId),
    /// The fleet could not evaluate a genotype.
    #[error("{0}")]
    EvaluationFailed(String),
    /// The parent of an imported fork is missing.
    #[error(
        "this experiment is a fork, and this coordinator does not have its parent: import the parent first"
    )]
    NoParent,
    /// A query without an answer.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// Only a worker in quarantine can be let out.
    #[error(
        "no worker \"{name}\" is in quarantine; {}",
        if there.is_empty() {
            "nobody is".to_owned()
        } else {
            format!("there are: {}", there.join(", "))
        }
    )]
    NotInQuarantine {
        /// The name that the client gave.
        name: String,
        /// The names of the workers in quarantine.
        there: Vec<String>,
    },
    /// The coordinator stops.
    #[error("the coordinator is shutting down")]
    ShuttingDown,
    /// A bug.
    #[error("{0} panicked; please report this")]
    Panicked(&'static str),
}

impl From<StoreError> for ControlError {
    fn from(error: StoreError) -> Self {
        Self::Query(error.into())
    }
}

impl Control {
    /// A handle to the coordinator with this driver and store. `memory_budget`: bytes of memory
    /// for all unfinished experiments together. `shutdown` ends checks in progress.
    pub fn new(
        events: EventSender,
        store: SharedStore,
        memory_budget: u64,
        shutdown: CancellationToken,
    ) -> Self {
        let evaluations = Arc::new(Semaphore::new(EVALUATIONS_MAX));
        Self {
            events,
            store,
            memory_budget,
            requests: Requests::new(shutdown),
            client: Client::default(),
            experiment_files: Arc::default(),
            evaluations,
            set_aside: Arc::default(),
            left_alone: Arc::default(),
        }
    }

    /// The same handle for one client: its checks take turns with those of other clients.
    pub fn for_client(&self, client: Client) -> Self {
        Self { client, ..self.clone() }
    }

    /// The connected workers, in the order in which they joined.
    pub async fn workers(&self) -> Result<Vec<WorkerStatus>, ControlError> {
        self.ask(DriverEvent::WorkersRequested).await
    }

    /// The evaluations in progress, without experiments.
    pub async fn evaluations(&self) -> Result<Vec<EvaluationActivity>, ControlError> {
        self.ask(DriverEvent::EvaluationsRequested).await
    }

    /// The recent work of every worker.
    pub async fn timeline(&self) -> Result<Vec<TimelineEntry>, ControlError> {
        self.ask(DriverEvent::TimelineRequested).await
    }

    /// Sends the driver a question and waits for the answer.
    async fn ask<T>(
        &self,
        question: impl FnOnce(oneshot::Sender<T>) -> DriverEvent,
    ) -> Result<T, ControlError> {
        let (reply, answer) = oneshot::channel();
        self.events.send(question(reply)).await.map_err(|_| ControlError::ShuttingDown)?;
        answer.await.map_err(|_| ControlError::ShuttingDown)
    }

    async fn find(&self, id: ExperimentId) -> Result<ExperimentRecord, ControlError> {
        Ok(self.store.read(move |store| queries::experiment(store, id)).await?.record)
    }

    /// Checks and writes as one operation, so that nothing changes in between.
    async fn check_and_write<T: Send + 'static>(
        &self,
        operation: impl FnOnce(&mut Store) -> Result<T, ControlError> + Send + 'static,
    ) -> Result<T, ControlError> {
        let operation = move |store: &mut Store| match operation(store) {
            // Only failures of the database are trouble of the shared store.
            Err(ControlError::Query(QueryError::Store(error))) => Err(error),
            other => Ok(other),
        };
        self.store.try_write(operation).await?
    }
}

#[cfg(test)]
mod tests;

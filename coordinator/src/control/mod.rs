//! What clients can have a running coordinator do: submit and steer experiments,
//! evaluate genotypes, ask what the fleet does.
//!
//! Works on core types. What is only read is in [`queries`](model::queries).

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

use crate::{
    driver::{DriverEvent, EventSender},
    engine::{EvaluationActivity, TimelineEntry, WorkerStatus},
    ids::ExperimentId,
    limits::{EVALUATIONS_MAX, REQUESTS_LEN_MAX, UNFINISHED_MAX},
    memory::Shortage,
    queries::{self, QueryError},
    shared_store::SharedStore,
    store::{ExperimentRecord, StoreError},
};

use experiment_files::ExperimentFiles;
use requests::Requests;

pub use evaluate::{CheckedEvaluation, EvaluationOrder};
pub use explain::Explanation;
pub use fitness::FitnessOrder;
pub use follow::{WatchError, watch};
pub use placement::{Existing, Placement, place};
pub use reopen::Reopening;
pub use submit::Submitted;
pub use turns::Client;

/// The way to a running coordinator.
#[derive(Debug, Clone)]
pub struct Control {
    events: EventSender,
    store: SharedStore,
    /// Bytes that all unfinished experiments may take together.
    memory_budget: u64,
    requests: Requests,
    /// Who asks.
    client: Client,
    experiment_files: Arc<ExperimentFiles>,
    /// One for each evaluation that is computed.
    evaluations: Arc<Semaphore>,
    /// Unfinished experiments that are damaged, so that the driver does not know them.
    set_aside: Arc<Mutex<BTreeSet<ExperimentId>>>,
    /// Unfinished experiments that nobody has asked for, so that the driver does not know them.
    left_alone: Arc<Mutex<BTreeSet<ExperimentId>>>,
}

/// Why something is not done.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// The client's mistake.
    #[error("{0}")]
    Invalid(String),
    /// The experiment file has mistakes.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Too much is going on already.
    #[error("{UNFINISHED_MAX} experiments are unfinished already; wait, or cancel some")]
    TooManyUnfinished,
    /// Clients have sent too much at the same time.
    #[error(
        "experiment files and genotypes of {} MiB, as much as the coordinator takes at the \
         same time, are being checked or wait to be evaluated; try again when some are done",
        REQUESTS_LEN_MAX >> 20
    )]
    TooManyRequests,
    /// An experiment is not in a state for it; the text says what to do.
    #[error("{0}")]
    NotNow(String),
    /// There is no memory for another experiment.
    #[error("{0}")]
    NoMemory(Shortage),
    /// A change is not stored in time; it will be.
    #[error(
        "the database does not take it that experiment {0} is changed; \
         the coordinator tries again, and its log says why"
    )]
    NotStoredYet(ExperimentId),
    /// The fleet could not evaluate a genotype.
    #[error("{0}")]
    EvaluationFailed(String),
    /// A fork comes without the experiment that it is a fork of.
    #[error("it is a fork of an experiment that this coordinator does not have: import that first")]
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
        /// Who is not there.
        name: String,
        /// The names of those who are.
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
    /// The way to the coordinator with this driver and store. `memory_budget`: bytes that
    /// all unfinished experiments may take together. `shutdown` ends what is being checked.
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

    /// The same for a client: what it has checked waits for its turn among those of all clients.
    pub fn for_client(&self, client: Client) -> Self {
        Self { client, ..self.clone() }
    }

    /// The connected workers, in the order in which they joined.
    pub async fn workers(&self) -> Result<Vec<WorkerStatus>, ControlError> {
        self.ask(DriverEvent::WorkersRequested).await
    }

    /// What is evaluated, experiments aside.
    pub async fn evaluations(&self) -> Result<Vec<EvaluationActivity>, ControlError> {
        self.ask(DriverEvent::EvaluationsRequested).await
    }

    /// Who computed what lately.
    pub async fn timeline(&self) -> Result<Vec<TimelineEntry>, ControlError> {
        self.ask(DriverEvent::TimelineRequested).await
    }

    /// Asks the driver something.
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
}

#[cfg(test)]
mod tests;

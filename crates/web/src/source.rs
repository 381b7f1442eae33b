//! The requests of pages to a running coordinator, in the messages of clients. Pages read
//! experiments like clients, through a [`Reader`](model::queries::Reader).

use std::{collections::BTreeMap, ops::Range, time::Duration};

use serde::Serialize;
use swarm_proto::v1::{Experiment, ExplainExperimentResponse, SubmitExperimentRequest, Worker};
use tonic::{Status, async_trait};

/// A running coordinator; a data directory alone has none.
#[async_trait]
pub trait Control: Send + Sync + 'static {
    /// The connected workers.
    async fn workers(&self) -> Result<Vec<Worker>, Status>;

    /// The latest assignments of the workers, in any order.
    async fn timeline(&self) -> Result<Vec<Assignment>, Status>;

    /// The activity of an experiment, or the reason why it waits.
    async fn explain(&self, id: u64) -> Result<ExplainExperimentResponse, Status>;

    /// Changes an experiment, and reads it again.
    async fn steer(&self, id: u64, action: Action) -> Result<Experiment, Status>;

    /// Starts an experiment.
    async fn submit(&self, request: SubmitExperimentRequest) -> Result<Experiment, Status>;
}

/// An action on an experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Pauses the experiment until it is resumed.
    Pause,
    /// Resumes the experiment.
    Resume,
    /// Ends the experiment.
    Cancel,
    /// Its share of the fleet relative to other experiments, 1 to 1000.
    Priority(u32),
    /// Whether it is in the archive.
    Archive(bool),
    /// Labels to set, and keys of labels to remove.
    Label(BTreeMap<String, String>, Vec<String>),
}

/// An assignment of a worker.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// The worker's connection.
    pub worker_id: u64,
    /// The name of the worker.
    pub worker_name: String,
    /// Number of the experiment; none for an evaluation.
    pub experiment: Option<u64>,
    /// The name of the batch, for people.
    pub batch: String,
    /// The individual within the batch.
    pub individual: u32,
    /// The trials of the individual.
    pub trials: Range<u32>,
    /// Time since it was sent to the worker.
    pub assigned_for: Duration,
    /// Time since its end; zero if it has not ended.
    pub ended_for: Duration,
    /// Time of computing; zero without a result.
    pub busy: Duration,
    /// The outcome of the assignment.
    pub fate: Fate,
}

/// The outcome of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fate {
    /// The worker has not answered yet.
    Unanswered,
    /// The worker returned a result.
    Computed,
    /// The coordinator took it back, because it was not needed any more or went to
    /// another worker.
    TakenBack,
    /// The worker reported a failure.
    Failed,
    /// The worker went away.
    Lost,
}

//! What pages ask of a running coordinator, in the messages of clients. They read experiments as
//! clients do, by [`Reader`](model::queries::Reader).

use std::{collections::BTreeMap, ops::Range, time::Duration};

use serde::Serialize;
use swarm_proto::v1::{Experiment, ExplainExperimentResponse, SubmitExperimentRequest, Worker};
use tonic::{Status, async_trait};

/// The coordinator that runs now; a data directory alone has none.
#[async_trait]
pub trait Control: Send + Sync + 'static {
    /// The connected workers.
    async fn workers(&self) -> Result<Vec<Worker>, Status>;

    /// Who computed what lately, in no order.
    async fn timeline(&self) -> Result<Vec<Assignment>, Status>;

    /// What an experiment does, or waits for.
    async fn explain(&self, id: u64) -> Result<ExplainExperimentResponse, Status>;

    /// Changes an experiment, and reads it again.
    async fn steer(&self, id: u64, action: Action) -> Result<Experiment, Status>;

    /// Starts an experiment.
    async fn submit(&self, request: SubmitExperimentRequest) -> Result<Experiment, Status>;
}

/// What can be done with an experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Until it is resumed.
    Pause,
    /// Goes on.
    Resume,
    /// Ends it.
    Cancel,
    /// Its weight in the sharing of the fleet, 1 to 1000.
    Priority(u32),
    /// Whether it is in the archive.
    Archive(bool),
    /// Labels to set, and keys of labels to remove.
    Label(BTreeMap<String, String>, Vec<String>),
}

/// Something that a worker was given to compute.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// The worker's connection.
    pub worker_id: u64,
    /// What the worker calls itself.
    pub worker_name: String,
    /// None: it is of an evaluation.
    pub experiment: Option<u64>,
    /// What it is a part of, for people.
    pub batch: String,
    /// Its individual, within that.
    pub individual: u32,
    /// The trials of the individual.
    pub trials: Range<u32>,
    /// Time since the worker was sent it.
    pub assigned_for: Duration,
    /// Time since its end; zero if it has not ended.
    pub ended_for: Duration,
    /// For how long it was computed; zero unless there is a result.
    pub busy: Duration,
    /// What has become of it.
    pub fate: Fate,
}

/// What has become of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fate {
    /// There is no answer yet.
    Unanswered,
    /// There is a result.
    Computed,
    /// It was not needed any more, or another worker was to compute it.
    TakenBack,
    /// The worker reported a failure.
    Failed,
    /// The worker went away.
    Lost,
}

//! The requests of pages to a running coordinator, in the messages of clients. Pages read
//! experiments like clients, through a [`Reader`](model::queries::Reader).

use std::collections::BTreeMap;

use engine::TimelineEntry;
use swarm_proto::v1::{Experiment, ExplainExperimentResponse, SubmitExperimentRequest, Worker};
use tonic::{Status, async_trait};

/// A running coordinator; a data directory alone has none.
#[async_trait]
pub trait Control: Send + Sync + 'static {
    /// The connected workers.
    async fn workers(&self) -> Result<Vec<Worker>, Status>;

    /// The latest assignments of the workers, in any order.
    async fn timeline(&self) -> Result<Vec<TimelineEntry>, Status>;

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

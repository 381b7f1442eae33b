//! The events that the driver handles.

use tokio::sync::{mpsc, oneshot, watch};
use tokio_util::sync::CancellationToken;

use engine::{
    EvaluationActivity, Introduction, ItemResult, JobActivity, TimelineEntry, ToWorker,
    WorkerStatus,
};

use crate::{
    ids::{ExperimentId, WorkerId},
    memory::Shortage,
    runs::{Evaluation, Request, Runnable},
};

use super::StatsSnapshot;

/// Capacity of the queue of events; senders wait while it is full.
const EVENT_QUEUE_LEN: usize = 1024;

/// Everything that can happen.
#[derive(Debug)]
pub enum DriverEvent {
    /// A worker has introduced itself and its versions agree.
    WorkerJoined {
        /// Its name, version and slots.
        introduction: Introduction,
        /// The channel to it.
        link: WorkerLink,
        /// Receives the worker's id.
        reply: oneshot::Sender<WorkerId>,
    },
    /// A worker has sent a message.
    WorkerSpoke(WorkerId, WorkerMessage),
    /// A worker's stream has ended.
    WorkerLeft {
        /// The worker.
        worker: WorkerId,
        /// How its stream ended, for the log.
        reason: String,
    },
    /// A stored experiment is ready to run.
    ExperimentReady(Box<Runnable>),
    /// A client wants to change an unfinished experiment.
    Requested {
        /// The experiment.
        experiment: ExperimentId,
        /// The change.
        request: Request,
        /// Answered once the change is stored; dropped if it will never be stored.
        reply: oneshot::Sender<()>,
    },
    /// A client wants to see the workers.
    WorkersRequested(oneshot::Sender<Vec<WorkerStatus>>),
    /// A client wants to see the evaluations in progress.
    EvaluationsRequested(oneshot::Sender<Vec<EvaluationActivity>>),
    /// A client wants to see the recent work of every worker.
    TimelineRequested(oneshot::Sender<Vec<TimelineEntry>>),
    /// A client lets a worker out of quarantine.
    WorkerReadmitted {
        /// The worker's name.
        name: String,
        /// Answered once the change is stored.
        reply: ReadmissionReply,
    },
    /// A client wants a genotype evaluated.
    EvaluationRequested(Box<Evaluation>, EvaluationReply),
    /// A client wants to know the fleet's work for an experiment, and the memory that it waits
    /// for, if any.
    ActivityRequested(ExperimentId, oneshot::Sender<(JobActivity, Option<Shortage>)>),
    /// A client wants to know when workers join, leave or stop getting items.
    FleetWatched(oneshot::Sender<watch::Receiver<u64>>),
    /// The metrics endpoint wants the statistics of fleet and experiments.
    StatsRequested(oneshot::Sender<StatsSnapshot>),
}

/// Receives the numbers of all trials, one trial after the other, or why the evaluation failed.
/// Dropping the receiver ends the evaluation.
pub type EvaluationReply = oneshot::Sender<Result<Vec<Vec<f64>>, String>>;

/// On failure, receives the names of the workers that are in quarantine.
pub type ReadmissionReply = oneshot::Sender<Result<(), Vec<String>>>;

/// A worker's message after its introduction.
#[derive(Debug)]
pub enum WorkerMessage {
    /// A sign of life.
    Heartbeat,
    /// Results of items.
    Results(Vec<ItemResult>),
    /// The worker wants no more items.
    Draining,
}

/// The channel to a connected worker.
#[derive(Debug)]
pub struct WorkerLink {
    /// Bounded. A worker that lets it fill up does not read, so the coordinator drops it.
    pub outbox: mpsc::Sender<ToWorker>,
    /// Cancelled when the coordinator has dropped the worker.
    pub dropped: CancellationToken,
}

/// Sends events to the driver.
pub type EventSender = mpsc::Sender<DriverEvent>;

/// A channel to a driver that is yet to run.
pub fn channel() -> (EventSender, mpsc::Receiver<DriverEvent>) {
    mpsc::channel(EVENT_QUEUE_LEN)
}

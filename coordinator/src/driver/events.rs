//! What the driver is told.

use tokio::sync::{mpsc, oneshot, watch};
use tokio_util::sync::CancellationToken;

use crate::{
    engine::{
        EvaluationActivity, Introduction, ItemResult, JobActivity, TimelineEntry, ToWorker,
        WorkerStatus,
    },
    ids::{ExperimentId, WorkerId},
    memory::Shortage,
    runs::{Evaluation, Request, Runnable},
};

use super::StatsSnapshot;

/// Events that wait for the driver; a sender of more waits.
const EVENT_QUEUE_LEN: usize = 1024;

/// Everything that can happen.
#[derive(Debug)]
pub enum DriverEvent {
    /// A worker has introduced itself and its versions agree.
    WorkerJoined {
        /// Its name, version and slots.
        introduction: Introduction,
        /// The way to it.
        link: WorkerLink,
        /// Gets its id.
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
    /// A stored experiment is to run.
    ExperimentReady(Box<Runnable>),
    /// A client wants something of an unfinished experiment.
    Requested {
        /// The experiment.
        experiment: ExperimentId,
        /// What the client wants.
        request: Request,
        /// Answered when it is stored; dropped if it is not going to be.
        reply: oneshot::Sender<()>,
    },
    /// A client wants to see the workers.
    WorkersRequested(oneshot::Sender<Vec<WorkerStatus>>),
    /// A client wants to see what is evaluated, experiments aside.
    EvaluationsRequested(oneshot::Sender<Vec<EvaluationActivity>>),
    /// Somebody wants to see who computed what lately.
    TimelineRequested(oneshot::Sender<Vec<TimelineEntry>>),
    /// A client lets a worker out of quarantine.
    WorkerReadmitted {
        /// What it calls itself.
        name: String,
        /// Answered when it is stored.
        reply: ReadmissionReply,
    },
    /// A client wants a genotype evaluated.
    EvaluationRequested(Box<Evaluation>, EvaluationReply),
    /// A client wants to know what the fleet does for an experiment, and how much memory it
    /// waits for, if it does.
    ActivityRequested(ExperimentId, oneshot::Sender<(JobActivity, Option<Shortage>)>),
    /// A client wants to hear of it when workers come, leave or are given nothing any more.
    FleetWatched(oneshot::Sender<watch::Receiver<u64>>),
    /// A metrics endpoint wants the numbers of all.
    StatsRequested(oneshot::Sender<StatsSnapshot>),
}

/// Gets the numbers of all trials, one trial after the other, or why there are none.
/// A dropped receiver ends the evaluation.
pub type EvaluationReply = oneshot::Sender<Result<Vec<Vec<f64>>, String>>;

/// Gets the names of those that are in quarantine if the worker is not.
pub type ReadmissionReply = oneshot::Sender<Result<(), Vec<String>>>;

/// What a worker says after its introduction.
#[derive(Debug)]
pub enum WorkerMessage {
    /// It is alive.
    Heartbeat,
    /// It has computed items.
    Results(Vec<ItemResult>),
    /// It wants no more items.
    Draining,
}

/// The way to a connected worker.
#[derive(Debug)]
pub struct WorkerLink {
    /// Bounded; a worker that lets it fill up does not read and is dropped.
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

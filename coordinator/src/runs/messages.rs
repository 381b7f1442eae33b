//! The inputs and outputs of [`Runs`](super::Runs), as plain data.

use std::sync::Arc;

use experiment_file::ExperimentConfig;

use engine::{Batch, EvaluatedBatch};
use evolution::NextLink;

use crate::{
    ids::{EvaluationId, ExperimentId, JobId},
    memory::Shortage,
    priority::Priority,
    store::ExperimentState,
};

use super::{Change, ReadyToCommit, RequestId, Round};

/// A request to the driver. Commands with a job are for the engine.
#[derive(Debug)]
pub enum Command {
    /// Make a job known to the engine.
    StartJob {
        /// The job.
        job: JobId,
        /// Its experiment's name.
        name: Arc<str>,
        /// The canonical configuration, for workers.
        spec: Arc<str>,
        /// Its priority.
        priority: Priority,
        /// Whether it is paused.
        is_paused: bool,
    },
    /// Read a run's evolution from the store, draw its next generation and report
    /// [`Runs::on_loaded`](super::Runs::on_loaded).
    Load {
        /// The run.
        run: RunId,
        /// Its configuration.
        config: Arc<ExperimentConfig>,
        /// Index of that generation.
        generation: u64,
    },
    /// Have the fleet evaluate a batch; the job has no other in progress.
    Evaluate {
        /// The job.
        job: JobId,
        /// Genotypes and trials.
        batch: Batch,
    },
    /// Take a job's work back from the fleet.
    PauseJob {
        /// The job.
        job: JobId,
    },
    /// Give a paused job's work to the fleet again.
    ResumeJob {
        /// The job.
        job: JobId,
    },
    /// Change a job's priority.
    SetPriority {
        /// The job.
        job: JobId,
        /// Its new priority.
        priority: Priority,
    },
    /// Have the fleet drop all work of a job.
    EndJob {
        /// The job.
        job: JobId,
    },
    /// Conclude a round, which may take long, and report
    /// [`Runs::on_concluded`](super::Runs::on_concluded).
    Conclude {
        /// The run.
        run: RunId,
        /// Its configuration.
        config: Arc<ExperimentConfig>,
        /// The evaluated round.
        round: Round,
        /// The fitness.
        evaluated: EvaluatedBatch,
    },
    /// Store a generation and report [`Runs::on_committed`](super::Runs::on_committed).
    Commit {
        /// The run.
        run: RunId,
        /// Its configuration.
        config: Arc<ExperimentConfig>,
        /// The generation, without its next round.
        ready: Box<ReadyToCommit>,
        /// The link of the generation after it, whose genes there is time to hash now.
        link: Option<Arc<NextLink>>,
    },
    /// Store a change and report [`Runs::on_change_written`](super::Runs::on_change_written).
    WriteChange {
        /// The experiment.
        experiment: ExperimentId,
        /// The change.
        change: Change,
    },
    /// Answer a client.
    Answer {
        /// Its request.
        request: RequestId,
        /// Whether the change is stored; if not, the coordinator is stopping.
        is_stored: bool,
    },
    /// Log that a run has failed or been cancelled.
    PublishEnd {
        /// The experiment.
        experiment: ExperimentId,
        /// Failed or cancelled.
        state: ExperimentState,
        /// For the experiment's owner.
        reason: String,
    },
    /// Log that a run waits for memory.
    PublishWait {
        /// The experiment.
        experiment: ExperimentId,
        /// The missing memory.
        shortage: Shortage,
    },
    /// Answer the client of an evaluation.
    AnswerEvaluation {
        /// The evaluation.
        evaluation: EvaluationId,
        /// For each genotype, the numbers of all trials, one trial after the other; or why the
        /// evaluation failed.
        result: Result<Vec<Vec<f64>>, String>,
    },
}

/// One run of an experiment; an extended experiment is a new run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunId {
    /// The experiment.
    pub experiment: ExperimentId,
    /// Counts runs since the coordinator started.
    pub run_epoch: u64,
}

/// The outcome of a commit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CommitOutcome {
    /// It is on disk.
    Stored,
    /// Nothing was stored, because the experiment has ended in the store, or the coordinator
    /// stops; nothing is lost.
    NotWanted,
    /// It can never be stored; the text says why.
    Failed(String),
}

//! What goes into the life of runs and what comes out of it, as plain data.

use std::sync::Arc;

use experiment_file::ExperimentConfig;

use crate::{
    engine::{Batch, EvaluatedBatch},
    ids::{EvaluationId, ExperimentId, JobId},
    memory::Shortage,
    priority::Priority,
    store::ExperimentState,
};

use super::{Change, ReadyToCommit, Round};

/// What the driver has to do. Those that name a job are for the engine.
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
        /// Its share of the fleet.
        priority: Priority,
        /// Whether it waits to be resumed.
        is_paused: bool,
    },
    /// Read a run's evolution from the store, draw its next generation and report
    /// [`Runs::on_loaded`](super::Runs::on_loaded).
    Load {
        /// Of which run.
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
    /// Change a job's share of the fleet.
    SetPriority {
        /// The job.
        job: JobId,
        /// Its new share.
        priority: Priority,
    },
    /// Have the fleet drop all work of a job.
    EndJob {
        /// The job.
        job: JobId,
    },
    /// Draw conclusions, which may take long, and report [`Runs::on_concluded`](super::Runs::on_concluded).
    Conclude {
        /// For which run.
        run: RunId,
        /// Its configuration.
        config: Arc<ExperimentConfig>,
        /// What was evaluated.
        round: Round,
        /// The fitness.
        evaluated: EvaluatedBatch,
    },
    /// Store a generation and report [`Runs::on_committed`](super::Runs::on_committed).
    Commit {
        /// Of which run.
        run: RunId,
        /// Its configuration.
        config: Arc<ExperimentConfig>,
        /// The generation; what comes next has been taken out.
        ready: Box<ReadyToCommit>,
    },
    /// Store a change and report [`Runs::on_change_written`](super::Runs::on_change_written).
    WriteChange {
        /// Of which experiment.
        experiment: ExperimentId,
        /// What to write.
        change: Change,
    },
    /// Answer a client.
    Answer {
        /// Its request.
        request: RequestId,
        /// Whether the store has what it wanted; if not, the coordinator stops.
        is_stored: bool,
    },
    /// Tell readers of the log that a run has failed or been cancelled.
    PublishEnd {
        /// Of which experiment.
        experiment: ExperimentId,
        /// Failed or cancelled.
        state: ExperimentState,
        /// For the experiment's owner.
        reason: String,
    },
    /// Tell readers of the log that a run waits for memory.
    PublishWait {
        /// Of which experiment.
        experiment: ExperimentId,
        /// How much is missing.
        shortage: Shortage,
    },
    /// Answer whoever wants an evaluation.
    AnswerEvaluation {
        /// The evaluation.
        evaluation: EvaluationId,
        /// Per genotype the numbers of all trials, one trial after the other, or why there are none.
        result: Result<Vec<Vec<f64>>, String>,
    },
}

/// One run of an experiment; after it has been given more generations, it is another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RunId {
    /// The experiment.
    pub experiment: ExperimentId,
    /// Counts runs since the coordinator started.
    pub run_epoch: u64,
}

/// A client's request that waits for an answer; given by the caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RequestId(pub u64);

/// What became of a commit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CommitOutcome {
    /// It is on disk.
    Stored,
    /// The experiment has ended in the store, or the coordinator stops; nothing is
    /// lost.
    NotWanted,
    /// It can never be stored; the text says why.
    Failed(String),
}

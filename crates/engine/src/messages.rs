//! The engine's inputs and outputs, as plain data.

use std::{num::NonZeroU64, ops::Range, sync::Arc, time::Duration};

use model::ids::{AssignmentId, JobId, QuestionId, WorkerId};
use sim_core::{Output, TrialSet};

use crate::{referee::RefereeRequest, shared_genotype::SharedGenotype};
use evolution::{Genotype, Population};

use super::NamePattern;

/// The genotypes and trials that a job evaluates at once: every genotype on every trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// The trial set.
    pub trial_set: TrialSet,
    /// The genotypes, by individual.
    pub genotypes: Population,
    /// The distribution from which workers can draw the genotypes themselves, if any.
    pub distribution: Option<Arc<[u8]>>,
    /// Trials per genotype: trials 0 to `n_trials` - 1 of the set.
    pub n_trials: u32,
    /// What workers return for a trial.
    pub output: Output,
    /// Numbers per trial, at least 1; 1 for [`Output::Fitness`].
    pub values_per_trial: usize,
}

impl Batch {
    /// The fitness of genotypes, one number per trial.
    pub fn fitness(trial_set: TrialSet, genotypes: Population, n_trials: u32) -> Self {
        Self {
            trial_set,
            genotypes,
            distribution: None,
            n_trials,
            output: Output::Fitness,
            values_per_trial: 1,
        }
    }

    /// The fitness of genotypes and, if there are any, this number of descriptors per trial.
    pub fn described(
        trial_set: TrialSet,
        genotypes: Population,
        n_trials: u32,
        n_descriptors: usize,
    ) -> Self {
        let fitness = Self::fitness(trial_set, genotypes, n_trials);
        match n_descriptors {
            0 => fitness,
            n => Self { output: Output::Descriptors, values_per_trial: 1 + n, ..fitness },
        }
    }

    /// The measures of one genotype on trials of evaluations, `values_per_trial`
    /// numbers each.
    pub fn measures(genotype: Genotype, n_trials: u32, values_per_trial: usize) -> Self {
        Self {
            trial_set: TrialSet::Evaluation,
            genotypes: vec![genotype].into(),
            distribution: None,
            n_trials,
            output: Output::Measures,
            values_per_trial,
        }
    }
}

/// A request to the caller.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Send a worker a message.
    Send(WorkerId, ToWorker),
    /// Close a worker's stream; the engine has forgotten the worker already.
    Disconnect {
        /// The worker whose stream it is.
        worker: WorkerId,
        /// For the log and for the worker.
        reason: String,
        /// Number of its items that go to other workers.
        n_items_requeued: usize,
    },
    /// A batch has all its results; the engine has forgotten the batch already.
    FinishBatch {
        /// The job whose batch it was.
        job: JobId,
        /// The results.
        evaluated: EvaluatedBatch,
    },
    /// Have the referee evaluate an item, after earlier questions, and report
    /// [`Engine::on_verdict`](super::Engine::on_verdict).
    AskReferee {
        /// Names this in the report.
        question: QuestionId,
        /// The item, with the specification of its job.
        request: RefereeRequest,
    },
    /// The engine no longer needs an answer of the referee.
    WithdrawQuestion {
        /// As given to [`Command::AskReferee`].
        question: QuestionId,
    },
    /// A worker is proved faulty. Store this: the worker gets no items until an operator readmits
    /// it.
    Quarantine {
        /// Its name.
        name: String,
        /// For people.
        reason: String,
    },
    /// A job has failed; the engine has forgotten it already.
    FailJob {
        /// The job.
        job: JobId,
        /// For its owner.
        reason: String,
    },
}

/// A message to a worker.
#[derive(Debug, Clone, PartialEq)]
pub enum ToWorker {
    /// Accepts the worker under this id. The caller creates this message.
    Welcome(WorkerId),
    /// A job's specification, as given to
    /// [`Engine::on_job_started`](super::Engine::on_job_started), before its first assignment.
    Spec(JobId, Arc<str>),
    /// The distribution from which the worker draws genotypes of a job's batch, as given to
    /// [`Engine::on_batch_requested`](super::Engine::on_batch_requested).
    Distribution(JobId, Arc<[u8]>),
    /// Items of a job's batch.
    Assignments(Assignments),
    /// Assignments whose results the engine no longer needs, at least one.
    Drop(Vec<AssignmentId>),
    /// The end or pause of a job that the worker knows.
    End(JobId),
    /// The coordinator drops the worker; the text says why. The caller creates this message.
    Dropped(String),
}

impl ToWorker {
    /// Bytes of the long parts: a specification, a distribution, or genes.
    pub fn payload_len(&self) -> usize {
        match self {
            Self::Spec(_, spec) => spec.len(),
            Self::Distribution(_, distribution) => distribution.len(),
            Self::Assignments(Assignments { items, .. }) => {
                let sent = items.iter().filter(|item| !item.is_drawn);
                sent.map(|item| size_of_val(item.genotype.as_slice())).sum()
            }
            Self::Welcome(_) | Self::Drop(_) | Self::End(_) | Self::Dropped(_) => 0,
        }
    }
}

/// Items of one batch, assigned to one worker.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignments {
    /// The job whose batch it is.
    pub job: JobId,
    /// The trial set.
    pub trial_set: TrialSet,
    /// What the worker returns for a trial.
    pub output: Output,
    /// At least one.
    pub items: Vec<Assignment>,
}

/// An item given to a worker: one genotype and the trials to run it on.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Names this assignment in the worker's result.
    pub id: AssignmentId,
    /// Trials to run, at least one.
    pub trials: Range<u32>,
    /// The genotype.
    pub genotype: SharedGenotype,
    /// Whether the worker draws the genotype from the job's latest distribution, instead of
    /// receiving it.
    pub is_drawn: bool,
}

/// A worker's result for an assignment.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemResult {
    /// The assignment.
    pub id: AssignmentId,
    /// The numbers of all its trials, one trial after the other, each as [`Batch::output`] says;
    /// or the worker's failure message.
    pub outcome: Result<Vec<f64>, String>,
    /// The worker's statement of the kind of these numbers.
    pub output: Output,
    /// The computing time that the worker reports.
    pub compute_time: Duration,
}

/// A batch with all its results.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedBatch {
    /// The trial set.
    pub trial_set: TrialSet,
    /// For each individual, the numbers of all its trials, one trial after the other:
    /// [`Batch::values_per_trial`] each.
    pub values: Vec<Vec<f64>>,
    /// From the batch's start to its last result.
    pub duration: Duration,
    /// Workers connected at its end.
    pub n_workers: usize,
    /// Share of the slots' time, 0 to 1, that led to no results meanwhile.
    pub idle_share: f64,
    /// Items that a second worker computed to the same bits.
    pub n_audited: usize,
    /// Items that were to be audited while there was no second worker.
    pub n_unaudited: usize,
    /// Notices for the experiment's owner about the results.
    pub notices: Vec<String>,
}

/// A worker's introduction of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Introduction {
    /// Its name.
    pub name: Arc<str>,
    /// Version of its software.
    pub version: String,
    /// Number of items that it computes at the same time.
    pub n_slots: usize,
    /// Pattern for the names of the experiments whose items it takes.
    pub experiments: NamePattern,
    /// Identifies its process; unchanged if it reconnects after its stream broke.
    pub process: Option<NonZeroU64>,
}

/// A connected worker, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerStatus {
    /// Its connection.
    pub id: WorkerId,
    /// Its name.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Number of items that it computes at the same time.
    pub n_slots: usize,
    /// Pattern for the names of the experiments whose items it takes.
    pub experiments: NamePattern,
    /// Number of assignments without a result.
    pub n_in_flight: usize,
    /// Results per second of about the last minute.
    pub results_per_s: f64,
    /// Share of its slots' time, 0 to 1, that led to no results in about the last minute.
    pub idle_share: f64,
    /// Time since its introduction.
    pub connected_for: Duration,
    /// Time since its last message.
    pub silent_for: Duration,
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Why it is in quarantine, if it is.
    pub quarantined: Option<String>,
    /// Why it gets nothing for a while, if that is so.
    pub waits: Option<String>,
}

/// The size of the fleet, for the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FleetSize {
    /// Number of connected workers.
    pub n_workers: usize,
    /// Number of their slots.
    pub n_slots: usize,
}

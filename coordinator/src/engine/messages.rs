//! What goes into the engine and what comes out of it, as plain data.

use std::{
    fmt,
    num::NonZeroU64,
    ops::{Deref, Range},
    sync::Arc,
    time::Duration,
};

use sim_core::{Output, TrialSet};

use crate::{
    ids::{AssignmentId, JobId, QuestionId, WorkerId},
    referee::RefereeRequest,
};
use evolution::{Genotype, Population};

use super::NamePattern;

/// What a job wants computed at once: every genotype on every trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Which worlds and noise the trials meet.
    pub trial_set: TrialSet,
    /// The genotypes, by individual.
    pub genotypes: Population,
    /// What workers can draw the genotypes from by themselves, if they can.
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

/// What the shell has to do.
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
        /// Number of items that it held and that others will get.
        n_items_requeued: usize,
    },
    /// All results of a batch are there; the engine has forgotten the batch already.
    FinishBatch {
        /// The job whose batch it was.
        job: JobId,
        /// The results.
        evaluated: EvaluatedBatch,
    },
    /// Have the referee evaluate an item, after those that it was asked for before, and report
    /// [`Engine::on_verdict`](super::Engine::on_verdict).
    AskReferee {
        /// Names this in the report.
        question: QuestionId,
        /// The item, with the specification of its job.
        request: RefereeRequest,
    },
    /// An answer of the referee is not needed any more.
    WithdrawQuestion {
        /// As given to [`Command::AskReferee`].
        question: QuestionId,
    },
    /// A worker is proved faulty: it is given nothing until an operator says otherwise, and
    /// this has to be remembered.
    Quarantine {
        /// What it calls itself.
        name: String,
        /// For people.
        reason: String,
    },
    /// A job cannot go on; the engine has forgotten it already.
    FailJob {
        /// The job.
        job: JobId,
        /// For its owner.
        reason: String,
    },
}

/// What a worker is told.
#[derive(Debug, Clone, PartialEq)]
pub enum ToWorker {
    /// It is welcome under this id; from the shell.
    Welcome(WorkerId),
    /// A job's specification, as given to
    /// [`Engine::on_job_started`](super::Engine::on_job_started), before its first assignment.
    Spec(JobId, Arc<str>),
    /// What a worker draws genotypes of a job's batch from, as given to
    /// [`Engine::on_batch_requested`](super::Engine::on_batch_requested).
    Distribution(JobId, Arc<[u8]>),
    /// Items of a job's batch.
    Assignments(Assignments),
    /// Assignments whose results are not wanted any more, at least one.
    Drop(Vec<AssignmentId>),
    /// A job that the worker knows is over, or paused.
    End(JobId),
    /// It is dropped; the text says why. From the shell.
    Dropped(String),
}

impl ToWorker {
    /// Bytes of what makes it long: a specification, or genes.
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

/// Items of one batch that a worker computes.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignments {
    /// The job whose batch it is.
    pub job: JobId,
    /// Which worlds and noise the trials meet.
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
    /// Whether the worker draws it, from the latest distribution of the job that it was sent.
    pub is_drawn: bool,
}

/// One genotype of a population, without a copy of its genes.
#[derive(Clone)]
pub struct SharedGenotype {
    /// The genotypes of all individuals.
    pub population: Population,
    /// Index of the individual among them.
    pub individual: u32,
}

impl From<Genotype> for SharedGenotype {
    fn from(genotype: Genotype) -> Self {
        Self { population: [genotype].into(), individual: 0 }
    }
}

impl Deref for SharedGenotype {
    type Target = Genotype;

    fn deref(&self) -> &Genotype {
        &self.population[self.individual as usize]
    }
}

impl PartialEq for SharedGenotype {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for SharedGenotype {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

/// What a worker returns for an assignment.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemResult {
    /// The assignment.
    pub id: AssignmentId,
    /// The numbers of all its trials, one trial after the other, each as
    /// [`Batch::output`] says; or why there are none.
    pub outcome: Result<Vec<f64>, String>,
    /// What the worker says that these numbers are.
    pub output: Output,
    /// Time that the worker says it computed.
    pub compute_time: Duration,
}

/// A batch with all its results.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedBatch {
    /// Which worlds and noise the trials met.
    pub trial_set: TrialSet,
    /// Per individual the numbers of all its trials, one trial after the other:
    /// [`Batch::values_per_trial`] each.
    pub values: Vec<Vec<f64>>,
    /// From the batch's start to its last result.
    pub duration: Duration,
    /// Workers connected at its end.
    pub n_workers: usize,
    /// Share of the slots' time, 0 to 1, that did not go into results meanwhile.
    pub idle_share: f64,
    /// Items that a second worker computed to the same bits.
    pub n_audited: usize,
    /// Items that were to be audited while there was no second worker.
    pub n_unaudited: usize,
    /// What the experiment's owner should know about its results.
    pub notices: Vec<String>,
}

/// Who a worker says it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Introduction {
    /// What it calls itself.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Items it computes at the same time.
    pub n_slots: usize,
    /// The experiments that it takes.
    pub experiments: NamePattern,
    /// Its process; the same when it comes back after its stream broke.
    pub process: Option<NonZeroU64>,
}

/// A connected worker as people see it.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkerStatus {
    /// Its connection.
    pub id: WorkerId,
    /// What it calls itself.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Items it computes at the same time.
    pub n_slots: usize,
    /// The experiments that it takes.
    pub experiments: NamePattern,
    /// Assignments that it has not answered.
    pub n_in_flight: usize,
    /// Results per second of about the last minute.
    pub results_per_s: f64,
    /// Share of its slots' time, 0 to 1, that did not go into results in about the
    /// last minute.
    pub idle_share: f64,
    /// Time since it introduced itself.
    pub connected_for: Duration,
    /// Time since its last sign of life.
    pub silent_for: Duration,
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Why it is in quarantine, if it is.
    pub quarantined: Option<String>,
    /// Why it is given nothing for a while, if that is so.
    pub waits: Option<String>,
}

/// The fleet as a reader of logs sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FleetSize {
    /// Connected workers.
    pub n_workers: usize,
    /// Their slots.
    pub n_slots: usize,
}

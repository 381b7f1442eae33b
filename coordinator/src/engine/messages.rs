//! What goes into the engine and what comes out of it, as plain data.

use std::{
    fmt,
    num::NonZeroU64,
    ops::{Deref, Range},
    sync::Arc,
    time::Duration,
};

use crate::ids::{ExperimentId, ItemId, WorkerId};
use evolution::{Genotype, Population};

/// What the shell has to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Send a worker the specification of an experiment.
    SendSpec {
        /// To whom.
        worker: WorkerId,
        /// Of what.
        experiment: ExperimentId,
        /// As given to [`Engine::on_experiment_started`](super::Engine::on_experiment_started).
        spec: Arc<str>,
    },
    /// Send a worker items of one generation.
    SendItems {
        /// To whom.
        worker: WorkerId,
        /// Of what.
        experiment: ExperimentId,
        /// Whose trial seeds apply.
        generation: u64,
        /// At least one.
        items: Vec<Item>,
    },
    /// Tell a worker that results are not wanted any more.
    SendDrop {
        /// To whom.
        worker: WorkerId,
        /// Of which assignments.
        items: Vec<ItemId>,
    },
    /// Tell a worker that an experiment is over, or paused.
    SendEnd {
        /// To whom.
        worker: WorkerId,
        /// What is over.
        experiment: ExperimentId,
    },
    /// Close a worker's stream; the engine has forgotten it already.
    Disconnect {
        /// Whose.
        worker: WorkerId,
        /// For the log and for the worker.
        reason: String,
        /// Items that it held and that others will get.
        n_items_requeued: usize,
    },
    /// A generation is judged.
    FinishGeneration {
        /// Of what.
        experiment: ExperimentId,
        /// The outcome.
        judged: JudgedGeneration,
    },
    /// An experiment must not go on until somebody has looked at it; the engine
    /// has paused it already.
    PauseExperiment {
        /// Which.
        experiment: ExperimentId,
        /// For its owner.
        reason: String,
    },
    /// An experiment cannot go on; the engine has forgotten it already.
    FailExperiment {
        /// Which.
        experiment: ExperimentId,
        /// For its owner.
        reason: String,
    },
}

/// One genotype and the trials to run it on, assigned to a worker.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// This assignment.
    pub id: ItemId,
    /// Trials to run.
    pub trials: Range<u32>,
    /// Its genes.
    pub genotype: SharedGenotype,
}

/// A genotype of a population that others hold, too.
#[derive(Clone)]
pub struct SharedGenotype {
    /// All of it.
    pub population: Population,
    /// Whose genotype this is.
    pub individual: u32,
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

/// A worker's answer to an item.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemResult {
    /// The assignment.
    pub id: ItemId,
    /// Fitness per trial, or all that is measured of each; or why there is none.
    pub outcome: Result<Vec<f64>, String>,
    /// Time the worker says it computed.
    pub compute_time: Duration,
}

/// A generation with all its fitness.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedGeneration {
    /// Index of the generation.
    pub generation: u64,
    /// Fitness per individual and trial; of an evaluation, all that was measured.
    pub trial_fitness: Vec<Vec<f64>>,
    /// From its start to its last result.
    pub duration: Duration,
    /// Workers connected at its end.
    pub n_workers: usize,
    /// Share of the slots' time, meanwhile, that was not spent on results that
    /// counted.
    pub idle_share: f64,
    /// Audits that agreed, and audits for which there was no second worker.
    pub n_audited: usize,
    /// See above.
    pub n_unaudited: usize,
}

/// Who a worker says it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Introduction {
    /// What it calls itself.
    pub name: String,
    /// Version of its software.
    pub version: String,
    /// Items it computes at the same time.
    pub n_slots: usize,
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
    /// Items it was given and has not answered.
    pub n_in_flight: usize,
    /// Recently.
    pub results_per_s: f64,
    /// Recent share of its slots' time not spent on results that counted.
    pub idle_share: f64,
    /// Time since it introduced itself.
    pub connected_for: Duration,
    /// Time since its last sign of life.
    pub silent_for: Duration,
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Why it is given no items, if its results are in doubt.
    pub distrusted: Option<String>,
}

/// The fleet as a reader of logs sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FleetSize {
    /// Connected workers.
    pub n_workers: usize,
    /// Their slots.
    pub n_slots: usize,
}

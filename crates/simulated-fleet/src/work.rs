//! What simulated workers compute, and what a spectator sees.

use std::{ops::Range, sync::Arc, time::Duration};

use engine::{SharedGenotype, Verdict};
use model::ids::{AssignmentId, QuestionId, WorkerId};
use sim_core::{Output, TrialSet};

/// An item that a worker or the referee computes.
#[derive(Debug, Clone, Copy)]
pub struct Order<'a> {
    /// The trial set.
    pub trial_set: TrialSet,
    /// The trials to run.
    pub trials: &'a Range<u32>,
    /// The genotype.
    pub genotype: &'a SharedGenotype,
    /// The kind of result for each trial.
    pub output: Output,
}

/// The work of a fleet.
pub trait Work {
    /// A number that tells genotypes apart. The durations of their trials follow from it.
    fn place(&self, genotype: &SharedGenotype) -> u64;

    /// The numbers of an item, or the message with which every worker fails.
    fn compute(&mut self, order: &Order<'_>) -> Result<Vec<f64>, String>;

    /// If a genotype takes its worker down, the time until then, relative to the time of a result.
    fn takes_down_after(&self, _genotype: &SharedGenotype) -> Option<u32> {
        None
    }

    /// The referee's answer.
    fn verdict(&mut self, order: &Order<'_>) -> Verdict {
        match self.compute(order) {
            Ok(values) => Verdict::Values(values),
            Err(failure) => Verdict::Failed(failure),
        }
    }

    /// Panics if a worker has another distribution than that from which it is to draw.
    fn check_distribution(&self, _trial_set: TrialSet, _known: Option<&Arc<[u8]>>) {}

    /// A spectator's view of what happens now.
    fn note(&mut self, _now: Duration, _note: Note) {}
}

/// What happens. Times are those since the beginning.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// The coordinator sends an item to a worker.
    Sent {
        /// The worker.
        worker: WorkerId,
        /// Names the item until its result has arrived.
        assignment: AssignmentId,
        /// Index of the individual.
        individual: u32,
        /// The trials.
        trials: Range<u32>,
        /// When the worker has it.
        arrives: Duration,
    },
    /// A worker begins to compute an item.
    Began {
        /// As in [`Note::Sent`].
        assignment: AssignmentId,
        /// When it will be computed.
        ends: Duration,
    },
    /// A worker sends a result.
    Returned {
        /// As in [`Note::Sent`].
        assignment: AssignmentId,
        /// When the coordinator has it.
        arrives: Duration,
    },
    /// The coordinator has a result.
    Arrived {
        /// As in [`Note::Sent`].
        assignment: AssignmentId,
    },
    /// A worker discards an item that the coordinator no longer needs.
    Dropped {
        /// As in [`Note::Sent`].
        assignment: AssignmentId,
    },
    /// The coordinator drops a worker.
    Disconnected {
        /// The worker.
        worker: WorkerId,
        /// For people.
        reason: String,
    },
    /// The coordinator asks the referee.
    Asked {
        /// Names the question.
        question: QuestionId,
        /// Index of the individual.
        individual: u32,
        /// The trials.
        trials: Range<u32>,
    },
    /// The referee answers.
    Answered {
        /// As in [`Note::Asked`].
        question: QuestionId,
    },
    /// A worker is proved faulty.
    Quarantined {
        /// Its name.
        name: String,
        /// For people.
        reason: String,
    },
}

//! Assignments from the coordinator, and their results.

use std::{borrow::Cow, ops::Range, sync::Arc, time::Duration};

use evolution::Distribution;
use model::ids::JobId;
use sim_core::{Output, TrialSet};

/// An item given to this worker: one genotype and the trials to run it on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Assignment {
    /// The coordinator's number, which the result carries.
    pub(crate) id: u64,
    pub(crate) job: JobId,
    /// The trial set.
    pub(crate) trial_set: TrialSet,
    /// The kind of result for each trial.
    pub(crate) output: Output,
    pub(crate) trials: Range<u32>,
    pub(crate) genotype: Genotype,
}

/// Where an assignment's genes come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Genotype {
    /// The coordinator sent them; unchecked.
    Sent(Vec<f64>),
    /// The worker draws them from the distribution that the coordinator sent, for this
    /// individual.
    Drawn(Arc<Distribution>, u32),
}

impl Genotype {
    /// The genes, or the reason why the worker cannot draw them.
    pub(crate) fn genes(&self) -> Result<Cow<'_, [f64]>, String> {
        match self {
            Self::Sent(genes) => Ok(Cow::Borrowed(genes)),
            Self::Drawn(distribution, individual) => {
                let genes = distribution.genotype(*individual as usize);
                let generation = distribution.generation();
                let none = || format!("generation {generation} has no individual {individual}");
                genes.map(Cow::Owned).ok_or_else(none)
            }
        }
    }
}

/// The result of an assignment.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ItemResult {
    pub(crate) assignment_id: u64,
    /// The kind of numbers in the outcome.
    pub(crate) output: Output,
    /// The numbers of all trials, one trial after the other; or why the item failed.
    pub(crate) outcome: Result<Vec<f64>, String>,
    /// Duration of the computation.
    pub(crate) duration: Duration,
}

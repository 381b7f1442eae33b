//! What the coordinator asks for, and what becomes of it.

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
    /// Which worlds and noise the trials meet.
    pub(crate) trial_set: TrialSet,
    /// What is returned for a trial.
    pub(crate) output: Output,
    pub(crate) trials: Range<u32>,
    pub(crate) genotype: Genotype,
}

/// Where an assignment's genes come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Genotype {
    /// They were sent; unchecked.
    Sent(Vec<f64>),
    /// They are drawn from what the coordinator sent, as the genes of this individual.
    Drawn(Arc<Distribution>, u32),
}

impl Genotype {
    /// The genes, or why there are none.
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
    /// What the numbers of the outcome are.
    pub(crate) output: Output,
    /// The numbers of all trials, one trial after the other; or why there are none.
    pub(crate) outcome: Result<Vec<f64>, String>,
    /// Time that the computation took.
    pub(crate) duration: Duration,
}

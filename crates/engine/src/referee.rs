//! What the engine asks the referee, and what the referee answers.

use std::{ops::Range, sync::Arc};

use sim_core::{Output, TrialSet};

use crate::SharedGenotype;

/// An item to evaluate.
#[derive(Debug, Clone, PartialEq)]
pub struct RefereeRequest {
    /// The experiment in its canonical form, the text that workers get. The process keeps the
    /// last few texts compiled.
    pub specification: Arc<str>,
    /// Genes, which reach the simulation without any change of bits.
    pub genotype: SharedGenotype,
    /// The trial set.
    pub trial_set: TrialSet,
    /// The trials of the set.
    pub trials: Range<u32>,
    /// The kind of result for each trial.
    pub output: Output,
}

/// The outcome of an item.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The item's numbers, one trial after the other, as the request's `output` says.
    Values(Vec<f64>),
    /// The item cannot be computed; the text is the message that every worker reports. A
    /// specification that does not compile is such a failure, and so is a panic.
    Failed(String),
    /// The process died during the item; the text has the signal or the exit code. A kill from
    /// outside (by a system without memory, or by a person) looks the same.
    Died(String),
    /// The referee could not answer, and the item is not to blame; the text says why and what to
    /// do. The process cannot be started, does not behave like a referee, or was told to stop
    /// (SIGTERM, SIGINT or SIGHUP, as at a shutdown of the machine).
    Unavailable(String),
}

impl Verdict {
    /// The same verdict with another text, if it has one.
    pub fn map_text(self, change: impl FnOnce(String) -> String) -> Self {
        match self {
            Self::Values(values) => Self::Values(values),
            Self::Failed(text) => Self::Failed(change(text)),
            Self::Died(text) => Self::Died(change(text)),
            Self::Unavailable(text) => Self::Unavailable(change(text)),
        }
    }
}

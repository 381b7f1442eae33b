//! Trials, as Python names them.

use pyo3::{exceptions::PyValueError, prelude::*};
use sim_core::TrialSet;

/// A range of a trial set, from `swarmevo.trials`: the kind, the generation, the block,
/// the first trial and the one after the last.
#[derive(FromPyObject)]
pub struct Trials(String, u64, u8, u32, u32);

impl Trials {
    /// The trial set.
    pub fn set(&self) -> PyResult<TrialSet> {
        let &Self(ref kind, generation, block, ..) = self;
        Ok(match kind.as_str() {
            "generation" => TrialSet::Generation(generation),
            "held_out" => TrialSet::HeldOut { generation, block },
            "judgement" => TrialSet::Judgement(generation),
            "evaluation" => TrialSet::Evaluation,
            _ => return Err(PyValueError::new_err(format!("no trials are called `{kind}`"))),
        })
    }

    /// The range of trials.
    pub fn range(&self) -> std::ops::Range<u32> {
        self.3..self.4
    }
}

//! A compiled experiment, whose episodes a page requests.

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use serde::{Deserialize, Serialize};
use sim_core::{Simulation, TrialSet};

/// A trial set in a message.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Trials {
    /// The trials of a generation.
    Generation(u64),
    /// A block of held-out trials.
    HeldOut {
        /// The generation that they follow.
        generation: u64,
        /// Index of the block.
        block: u8,
    },
    /// The trials of the judgement after a generation.
    Judgement(u64),
    /// The trials of evaluations.
    Evaluation,
}

impl From<TrialSet> for Trials {
    fn from(trial_set: TrialSet) -> Self {
        match trial_set {
            TrialSet::Generation(generation) => Self::Generation(generation),
            TrialSet::HeldOut { generation, block } => Self::HeldOut { generation, block },
            TrialSet::Judgement(generation) => Self::Judgement(generation),
            TrialSet::Evaluation => Self::Evaluation,
        }
    }
}

impl From<Trials> for TrialSet {
    fn from(trials: Trials) -> Self {
        match trials {
            Trials::Generation(generation) => Self::Generation(generation),
            Trials::HeldOut { generation, block } => Self::HeldOut { generation, block },
            Trials::Judgement(generation) => Self::Judgement(generation),
            Trials::Evaluation => Self::Evaluation,
        }
    }
}

/// Compiles an experiment file.
pub fn compile(config_json: &str) -> Result<Simulation, String> {
    let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .map_err(|error| error.to_string())?;
    Simulation::compile(&config).map_err(|error| error.to_string())
}

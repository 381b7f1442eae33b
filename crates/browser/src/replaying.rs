//! Episodes that a page simulates again, with changes.

use replay::{Episode, Replay, WhatIf};
use serde::Deserialize;
use sim_core::TrialSet;

/// An individual, and the episode that its page shows without changes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Played {
    /// The experiment file.
    config: String,
    /// The name of the genotype, for people.
    name: String,
    /// Generation of the individual.
    generation: u64,
    /// The worlds.
    trials: TrialSet,
    trial: u32,
}

impl Played {
    /// Simulates the changed episode of a genotype, and packs it for the player. `what_if`: the
    /// changes, as the query of an address.
    pub fn simulate(&self, what_if: &str, genotype: &[f64]) -> Result<Vec<u8>, String> {
        let what_if = WhatIf::from_query(what_if)?;
        let (config, simulation) =
            what_if.compile(&self.config).map_err(|error| error.to_string())?;
        let (trial_set, trial) = what_if.world(self.generation, self.trials, self.trial);
        let (config, simulation, name) = (&config, &simulation, &*self.name);
        let episode = Episode { config, simulation, genotype, name, trial_set, trial };
        let replay = Replay::simulate(&episode).map_err(|error| error.to_string())?;
        Ok(replay.encode())
    }
}

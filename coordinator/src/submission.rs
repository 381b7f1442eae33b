//! From an experiment file to an experiment that can be stored and run.

use experiment_file::{ConfigError, ExperimentConfig};

use crate::{priority::Priority, store::NewExperiment};
use evolution::{ALGORITHMS, Digest, Evolution};

/// What a client submits.
#[derive(Debug, Clone, Default)]
pub struct Submission {
    /// Key against double submission.
    pub request_id: Option<String>,
    /// The experiment file.
    pub config_json: String,
    /// Name if the file gives none.
    pub default_name: String,
    /// Replaces the file's seed.
    pub seed: Option<u64>,
    /// Replaces the file's number of generations.
    pub generations: Option<u64>,
    /// Its share of the fleet.
    pub priority: Priority,
}

/// A submission that has passed all checks.
#[derive(Debug)]
pub struct CheckedSubmission {
    /// For the store.
    pub new: NewExperiment,
    /// Keys of the file without effect, and parameters that keep their defaults; one
    /// line each.
    pub warnings: Vec<String>,
}

impl Submission {
    /// Checks everything about a submission; it can run if this succeeds.
    pub fn check(self) -> Result<CheckedSubmission, ConfigError> {
        let (mut config, warnings) =
            ExperimentConfig::from_json(&self.config_json, &self.default_name, ALGORITHMS)?;
        if self.seed.is_some() || self.generations.is_some() {
            config.seed = self.seed.unwrap_or(config.seed);
            config.algorithm.generations = self.generations.unwrap_or(config.algorithm.generations);
            // The file's limits hold for what replaces parts of it, too.
            let name = config.name.clone();
            (config, _) =
                ExperimentConfig::from_json(&config.to_canonical_json(), &name, ALGORITHMS)?;
        }
        let experiment = sim_core::Simulation::compile(&config)?;
        experiment.check_starts(&config.algorithm)?;
        let evolution =
            Evolution::new(&config, experiment.population_segments(), sim_core::FINGERPRINT);
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        warnings.extend(experiment.uncovered_parameters().iter().cloned());
        let new = NewExperiment {
            request_id: self.request_id,
            config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
            genotype_len: experiment.genotype_len(),
            checkpoint: evolution.state(),
            priority: self.priority,
            config,
        };
        Ok(CheckedSubmission { new, warnings })
    }
}

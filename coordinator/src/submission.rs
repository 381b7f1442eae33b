//! From an experiment file, or a row of the store, to an experiment that can
//! run.

use std::sync::Arc;

use experiment_file::{ConfigError, ExperimentConfig};

use crate::{
    driver::Round,
    ids::ExperimentId,
    priority::Priority,
    store::{self, ExperimentState, Generation, NewExperiment, StoreError},
};
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
pub struct Checked {
    /// For the store.
    pub new: NewExperiment,
    /// Before its first generation.
    pub evolution: Evolution,
    /// Keys of the file without effect, and parameters of the network that keep
    /// their defaults; one line each.
    pub warnings: Vec<String>,
}

/// An experiment that can run.
#[derive(Debug)]
pub struct Runnable {
    /// Its id.
    pub id: ExperimentId,
    /// Its configuration.
    pub config: ExperimentConfig,
    /// The canonical configuration, for workers.
    pub spec: Arc<str>,
    /// The latest generation that is stored.
    pub latest: Option<Generation>,
    /// What is to be judged first.
    pub round: Round,
    /// Its share of the fleet.
    pub priority: Priority,
    /// Whether it waits to be resumed.
    pub is_paused: bool,
}

impl Submission {
    /// Checks everything about a submission; it can run if this succeeds.
    pub fn check(self) -> Result<Checked, ConfigError> {
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
        let evolution =
            Evolution::new(&config, experiment.population_segments(), sim_core::FINGERPRINT);
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        warnings.extend(experiment.uncovered_parameters().iter().cloned());
        let new = NewExperiment {
            request_id: self.request_id,
            config_digest: Digest::of_config(&config, sim_core::FINGERPRINT),
            genotype_len: experiment.genotype_len(),
            checkpoint: checkpoint_json(&evolution),
            priority: self.priority,
            config,
        };
        Ok(Checked { new, evolution, warnings })
    }
}

impl Runnable {
    /// An experiment whose evolution stands somewhere, and that is not paused.
    /// Asks for its next generation, which may take a while.
    pub fn new(
        id: ExperimentId,
        config: ExperimentConfig,
        evolution: Evolution,
        priority: Priority,
    ) -> Self {
        let spec = config.to_canonical_json().into();
        let round = Round::generation(evolution);
        Self { id, spec, config, latest: None, round, priority, is_paused: false }
    }

    /// An experiment as the store has it.
    pub fn restore(experiment: &store::Experiment, checkpoint: &str) -> Result<Self, StoreError> {
        let id = experiment.id;
        let corrupt = |what: &str, error: &dyn std::fmt::Display| {
            StoreError::Corrupt(format!("{what} of experiment {id}: {error}"))
        };
        let (config, _) = ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)
            .map_err(|error| corrupt("configuration", &error))?;
        let evolution =
            serde_json::from_str(checkpoint).map_err(|error| corrupt("checkpoint", &error))?;
        let is_paused = experiment.state == ExperimentState::Paused;
        let latest = experiment.latest.clone();
        Ok(Self { is_paused, latest, ..Self::new(id, config, evolution, experiment.priority) })
    }
}

/// Evolution as the store keeps it.
pub fn checkpoint_json(evolution: &Evolution) -> String {
    serde_json::to_string(evolution).expect("numbers and lists serialise")
}

//! An experiment that can run: just submitted, or as the store has it.

use std::{fmt, sync::Arc};

use evolution::{ALGORITHMS, Evolution};
use experiment_file::ExperimentConfig;

use crate::{
    ids::ExperimentId,
    priority::Priority,
    store::{ExperimentRecord, ExperimentState, GenerationRecord, StoreError},
};

use super::Round;

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
    pub latest: Option<GenerationRecord>,
    /// What is to be evaluated first.
    pub round: Round,
    /// Its share of the fleet.
    pub priority: Priority,
    /// Whether it waits to be resumed.
    pub is_paused: bool,
}

impl Runnable {
    /// An experiment that is not paused, with its evolution after some generation.
    /// Draws the next generation, which may take long.
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

    /// An experiment as the store has it. `checkpoint`: evolution, as JSON.
    pub fn restore(experiment: &ExperimentRecord, checkpoint: &str) -> Result<Self, StoreError> {
        let id = experiment.id;
        let corrupt = |what: &str, error: &dyn fmt::Display| {
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

//! An experiment that can run: just submitted, or as the store has it.

use std::sync::Arc;

use evolution::{ALGORITHMS, Digest, Evolution};
use experiment_file::ExperimentConfig;

use crate::{
    ids::ExperimentId,
    priority::Priority,
    store::{ExperimentRecord, ExperimentState, GenerationRecord},
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

    /// An experiment as the store has it, or what contradicts what. `checkpoint`:
    /// evolution, as JSON.
    pub fn restore(experiment: &ExperimentRecord, checkpoint: &str) -> Result<Self, String> {
        let id = experiment.id;
        let (config, _) = ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)
            .map_err(|error| format!("its configuration is not valid: {error}"))?;
        let config_digest = Digest::of_config(&config, &experiment.fingerprint).to_string();
        if config_digest != experiment.config_digest {
            return Err(format!(
                "its configuration has the digest {config_digest}, and not {}",
                experiment.config_digest
            ));
        }
        let evolution: Evolution = serde_json::from_str(checkpoint)
            .map_err(|error| format!("its checkpoint is not valid: {error}"))?;
        let (n_generations, link) = match &experiment.latest {
            Some(latest) => (latest.generation + 1, &latest.digest),
            None => (0, &config_digest),
        };
        if evolution.n_generations() != n_generations || evolution.digest().to_string() != *link {
            return Err(format!(
                "its history has {n_generations} generations and digest {link}, its checkpoint {} and \
                 {}",
                evolution.n_generations(),
                evolution.digest()
            ));
        }
        let is_paused = experiment.state == ExperimentState::Paused;
        let latest = experiment.latest.clone();
        Ok(Self { is_paused, latest, ..Self::new(id, config, evolution, experiment.priority) })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use evolution::Statistics;

    use super::*;
    use crate::submission::Submission;

    /// A new experiment and its checkpoint.
    fn stored() -> (ExperimentRecord, String) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
        let config_json = fs::read_to_string(path).unwrap();
        let new = Submission { config_json, ..Submission::default() }.check().unwrap().new;
        let experiment = ExperimentRecord {
            id: ExperimentId(1),
            config_json: new.config.to_canonical_json(),
            config_digest: new.config_digest.to_string(),
            fingerprint: sim_core::FINGERPRINT.to_owned(),
            genotype_len: new.genotype_len as u64,
            state: ExperimentState::Running,
            reason: String::new(),
            submitted_at_ms: 0,
            latest: None,
            digest: String::new(),
            champion_fitness: None,
            priority: Priority::default(),
            last_sequence: 1,
        };
        (experiment, new.checkpoint)
    }

    #[test]
    fn what_contradicts_itself_is_not_run() {
        let (sound, checkpoint) = stored();
        Runnable::restore(&sound, &checkpoint).unwrap();

        let config_json = sound.config_json.replacen("\"seed\":1", "\"seed\":2", 1);
        assert_ne!(config_json, sound.config_json);
        let edited = ExperimentRecord { config_json, ..sound.clone() };
        let what = Runnable::restore(&edited, &checkpoint).unwrap_err();
        assert!(what.contains("its configuration has the digest"), "{what}");

        let latest = GenerationRecord {
            generation: 0,
            statistics: Statistics { best: 0.0, mean: 0.0, min: 0.0, standard_deviation: 0.0 },
            digest: sound.config_digest.clone(),
            duration_ms: 1,
            episodes: 1,
            workers: 1,
            idle_share: 0.0,
        };
        let ahead = ExperimentRecord { latest: Some(latest), ..sound.clone() };
        let what = Runnable::restore(&ahead, &checkpoint).unwrap_err();
        assert!(what.contains("its history has 1 generations"), "{what}");

        let other = checkpoint.replace(&sound.config_digest, &"0".repeat(64));
        let what = Runnable::restore(&sound, &other).unwrap_err();
        assert!(what.contains("its history has 0 generations"), "{what}");
    }
}

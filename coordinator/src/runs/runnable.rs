//! Experiments that can run, newly submitted or restored from the store.

use std::sync::Arc;

use evolution::Checkpoint;
use experiment_file::ExperimentConfig;
use model::restored::restore;

use crate::{
    ids::ExperimentId,
    memory,
    priority::Priority,
    store::{ExperimentState, GenerationRecord, StoredExperiment, Summary},
};

/// An experiment that can run. The driver reads its evolution from the store once there is memory
/// for it.
#[derive(Debug)]
pub struct Runnable {
    /// Its id.
    pub id: ExperimentId,
    /// Its configuration.
    pub config: ExperimentConfig,
    /// The canonical configuration, for workers.
    pub spec: Arc<str>,
    /// Estimated bytes that it takes while it runs.
    pub memory: u64,
    /// The latest stored generation.
    pub latest: Option<GenerationRecord>,
    /// Its priority.
    pub priority: Priority,
    /// Whether it is paused.
    pub is_paused: bool,
}

impl Runnable {
    /// An experiment that is not paused, before its first generation.
    pub fn new(
        id: ExperimentId,
        config: ExperimentConfig,
        genotype_len: u64,
        priority: Priority,
    ) -> Self {
        let spec: Arc<str> = config.to_canonical_json().into();
        let memory = memory::estimate(&Summary::from_config(&config, &spec), genotype_len);
        Self { id, spec, config, memory, latest: None, priority, is_paused: false }
    }

    /// Restores an experiment from the store, or says which stored values contradict each other.
    pub fn restore(experiment: &StoredExperiment, checkpoint: &Checkpoint) -> Result<Self, String> {
        let (id, (config, _)) = (experiment.id, restore(experiment, checkpoint)?);
        let is_paused = experiment.state == ExperimentState::Paused;
        let latest = experiment.latest.clone();
        let new = Self::new(id, config, experiment.genotype_len, experiment.priority);
        Ok(Self { is_paused, latest, ..new })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use evolution::Statistics;

    use super::*;
    use crate::{
        labels::Labels,
        store::{ExperimentRecord, LogGap},
        submission::Submission,
    };

    /// A new experiment and its checkpoint.
    fn stored() -> (StoredExperiment, Checkpoint) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
        let config_json = fs::read_to_string(path).unwrap();
        let new = Submission { config_json, ..Submission::default() }.check(&|| true).unwrap().new;
        let config_json = new.config.to_canonical_json();
        let record = ExperimentRecord {
            id: ExperimentId(1),
            name: new.config.name.clone(),
            summary: Summary::from_config(&new.config, &config_json),
            config_digest: new.config_digest.to_string(),
            fingerprint: sim_core::FINGERPRINT.to_owned(),
            genotype_len: new.genotype_len as u64,
            state: ExperimentState::Running,
            reason: String::new(),
            submitted_at_ms: 0,
            latest: None,
            digest: String::new(),
            held_out_fitness: None,
            judged_fitness: None,
            priority: Priority::default(),
            last_sequence: 1,
            membership: None,
            labels: Labels::new(),
            is_archived: false,
            recent_generation_ms: None,
            log_from: 0,
            log_gap: LogGap::None,
            fork: None,
        };
        let stored = StoredExperiment { record, config_json };
        (stored, Checkpoint { keyframe: new.keyframe, ..Checkpoint::default() })
    }

    #[test]
    fn contradictory_stored_values_are_not_run() {
        let (sound, checkpoint) = stored();
        Runnable::restore(&sound, &checkpoint).unwrap();

        let config_json = sound.config_json.replacen("\"seed\":1", "\"seed\":2", 1);
        assert_ne!(config_json, sound.config_json);
        let edited = StoredExperiment { config_json, ..sound.clone() };
        let what = Runnable::restore(&edited, &checkpoint).unwrap_err();
        assert!(what.contains("its configuration has the digest"), "{what}");

        let latest = GenerationRecord {
            generation: 0,
            statistics: Statistics::from_fitness(&[0.0]),
            digest: sound.config_digest.clone(),
            duration_ms: 1,
            episodes: 1,
            workers: 1,
            idle_share: 0.0,
        };
        let mut ahead = sound.clone();
        ahead.record.latest = Some(latest);
        let what = Runnable::restore(&ahead, &checkpoint).unwrap_err();
        assert!(what.contains("its history has 1 generations"), "{what}");

        let of_other_seed = Submission {
            config_json: sound.config_json.clone(),
            seed: Some(2),
            ..Submission::default()
        };
        let keyframe = of_other_seed.check(&|| true).unwrap().new.keyframe;
        let other = Checkpoint { keyframe, ..Checkpoint::default() };
        let what = Runnable::restore(&sound, &other).unwrap_err();
        assert!(what.contains("its history has 0 generations"), "{what}");
    }
}

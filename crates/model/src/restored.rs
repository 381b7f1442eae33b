//! Restores the evolution of a stored experiment.

use evolution::{ALGORITHMS, Checkpoint, Digest, Evolution};
use experiment_file::ExperimentConfig;

use crate::store::StoredExperiment;

/// Configuration and evolution of a stored experiment, or the contradiction between stored
/// values.
pub fn restore(
    experiment: &StoredExperiment,
    checkpoint: &Checkpoint,
) -> Result<(ExperimentConfig, Evolution), String> {
    let (config, _) = ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)
        .map_err(|error| format!("its configuration is not valid: {error}"))?;
    let config_digest = Digest::of_config(&config, &experiment.fingerprint).to_string();
    if config_digest != experiment.config_digest {
        return Err(format!(
            "its configuration has the digest {config_digest}, and not {}",
            experiment.config_digest
        ));
    }
    let evolution = Evolution::restore(checkpoint)
        .map_err(|error| format!("its checkpoint is not valid: {error}"))?;
    let (n_generations, link) = (experiment.n_generations(), experiment.last_link());
    if evolution.n_generations() != n_generations || evolution.digest().to_string() != link {
        return Err(format!(
            "its history has {n_generations} generations and digest {link}, its checkpoint {} and \
             {}",
            evolution.n_generations(),
            evolution.digest()
        ));
    }
    Ok((config, evolution))
}

/// The evolution alone.
pub fn restore_evolution(
    experiment: &StoredExperiment,
    checkpoint: &Checkpoint,
) -> Result<Evolution, String> {
    restore(experiment, checkpoint).map(|(_, evolution)| evolution)
}

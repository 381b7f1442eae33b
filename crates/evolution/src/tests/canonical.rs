//! The parameters in the canonical form of an experiment: digests hash these bytes.

use experiment_file::ExperimentConfig;
use serde_json::{Value, json};

use super::by_fitness;
use crate::ALGORITHMS;

const EXPERIMENT: &str = include_str!("../../../../configs/quickstart.json");

/// The canonical form of an experiment by this algorithm with its defaults.
fn canonical(algorithm: &str) -> String {
    canonical_with(algorithm, &json!({}))
}

fn canonical_with(algorithm: &str, params: &Value) -> String {
    let mut file: Value = serde_json::from_str(EXPERIMENT).unwrap();
    file["algorithm"]["name"] = json!(algorithm);
    for population in file["algorithm"]["populations"].as_object_mut().unwrap().values_mut() {
        population["params"] = params.clone();
    }
    let (config, _) = ExperimentConfig::from_json(&file.to_string(), "", ALGORITHMS).unwrap();
    config.to_canonical_json()
}

#[test]
fn defaults_are_written_out_in_a_fixed_order() {
    for (algorithm, expected) in [
        (
            "GA",
            r#"{"selection_operator":"tournament","tournament_size":3,"mating_operator":"random","crossover_operator":"blxalpha","alpha":0.5,"crossover_prob":0.9,"mutation_operator":"gaussian","mutation_prob":0.05,"mutation_sigma":0.5477225575051661,"num_elite":3}"#,
        ),
        ("SNES", r#"{"eta_mu":1.0,"mu_init":0.5,"sigma_init":0.2}"#),
        ("xNES", r#"{"eta_mu":1.0,"mu_init":0.5,"sigma_init":0.2}"#),
        ("CMA-ES", r#"{"mu_init":0.5,"sigma_init":0.2}"#),
        ("sep-CMA-ES", r#"{"mu_init":0.5,"sigma_init":0.2}"#),
        (
            "openaiES",
            r#"{"mu_init":0.5,"sigma":0.1,"learning_rate":0.02,"beta1":0.9,"beta2":0.999,"weight_decay":0.0}"#,
        ),
        (
            "PGPE",
            r#"{"mu_init":0.5,"sigma_init":0.2,"momentum":0.9,"eta_sigma":0.1,"sigma_max_change":0.2}"#,
        ),
    ] {
        let canonical = canonical(algorithm);
        assert!(canonical.contains(&format!(r#""params":{expected}"#)), "{canonical}");
    }
}

#[test]
fn a_recent_key_is_written_out_unless_it_has_its_default() {
    let of_restarts = |restarts: &str| canonical_with("CMA-ES", &json!({"restarts": restarts}));
    assert_eq!(of_restarts("none"), canonical("CMA-ES"));
    let with = r#""params":{"mu_init":0.5,"sigma_init":0.2,"restarts":"bipop"}"#;
    assert!(of_restarts("bipop").contains(with));
}

#[test]
fn a_canonical_form_reads_back_to_the_same_bytes_with_and_without_descriptions() {
    for algorithm in by_fitness() {
        let canonical = canonical(algorithm.name);
        let (described, _) = ExperimentConfig::from_json(&canonical, "", ALGORITHMS).unwrap();
        let unchecked = ExperimentConfig::from_canonical_json(&canonical).unwrap();
        assert_eq!(described.to_canonical_json(), canonical);
        assert_eq!(unchecked.to_canonical_json(), canonical);
    }
}

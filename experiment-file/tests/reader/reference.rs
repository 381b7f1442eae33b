//! Files of the original simulator, accepted unchanged. They are not part of
//! the project: where they are absent, these tests say so and pass.

use std::io::Write as _;

use super::{defaults, read};
use experiment_file::{ExperimentConfig, FitnessFunction};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/reference/");

/// The configuration, and the paths of its warnings.
fn reference(file: &str) -> Option<(ExperimentConfig, Vec<String>)> {
    let path = format!("{FOLDER}{file}");
    let Ok(text) = std::fs::read_to_string(&path) else {
        // Past the capture of a test's output; `.ci/run` lists these lines.
        let _ = std::io::stderr().write_all(format!("\nSKIPPED: {path} is absent\n").as_bytes());
        return None;
    };
    let (config, warnings) = read(&text).unwrap_or_else(|error| panic!("{error}"));
    Some((config, warnings.into_iter().map(|warning| warning.path).collect()))
}

#[test]
fn experiment_a_is_accepted_unchanged() {
    let Some((config, warnings)) = reference("experimentA_SNES_ctrnn.json") else {
        return;
    };
    let ignored = ["num_processes", "render", "world.world_delay", "world.render_connections"];
    assert_eq!(warnings, ignored);
    assert_eq!(config.name, "chk_experimentA_SNES_ctrnn");
    assert_eq!(config.algorithm.fitness_function, FitnessFunction::IdentifyLeader);
    let population = &config.algorithm.populations["p4"];
    assert_eq!(population.params, defaults("SNES"));
    assert_eq!(config.topology.synapses.len(), 15);
}

#[test]
fn experiment_d_is_accepted_unchanged() {
    let Some((config, warnings)) = reference("experimentD_GA_ctrnn.json") else {
        return;
    };
    let ignored =
        ["world.world_delay", "world.render_connections", "world.objects.light_red.positions"];
    assert_eq!(warnings, ignored);
    assert_eq!(config.algorithm.fitness_function, FitnessFunction::GotoLight);
    let population = &config.algorithm.populations["p1"];
    assert_eq!(population.params, defaults("GA"));
}

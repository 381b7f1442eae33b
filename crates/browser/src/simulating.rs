//! A compiled experiment, whose episodes a page requests.

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use sim_core::Simulation;

/// Compiles an experiment file.
pub fn compile(config_json: &str) -> Result<Simulation, String> {
    let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .map_err(|error| error.to_string())?;
    Simulation::compile(&config).map_err(|error| error.to_string())
}

//! Compiles an experiment file, and prints the structure of its genotypes.
//!
//! ```sh
//! cargo run -p sim-core --example compile -- configs/leader_selection_snes.json
//! ```

use std::{env, error::Error, fs};

use experiment_file::ExperimentConfig;
use sim_core::Simulation;

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args().nth(1).ok_or("usage: compile EXPERIMENT")?;
    let text = fs::read_to_string(&path)?;
    let (config, warnings) = ExperimentConfig::from_json(&text, "example", evolution::ALGORITHMS)?;
    for warning in warnings {
        println!("warning: {warning}");
    }
    let simulation = Simulation::compile(&config)?;
    println!("{}", config.name);
    println!("genes of a genotype: {}", simulation.genotype_len());
    for (name, genes) in config.algorithm.populations.keys().zip(simulation.population_segments()) {
        println!("population `{name}`: genes {} to {}", genes.start, genes.end - 1);
    }
    for parameter in simulation.uncovered_parameters() {
        println!("not in the genotype: {parameter}");
    }
    println!("steps of an episode: {}", simulation.n_steps());
    println!("measures: {}", simulation.measure_names().join(", "));
    Ok(())
}

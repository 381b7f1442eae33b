//! Evaluates random genotypes and prints the mean fitness of each.
//!
//! ```sh
//! cargo run --release -p sim-core --example evaluate -- configs/leader_selection_snes.json
//! ```

use std::{env, error::Error, fs};

use determinism::random::{Purpose, Stream};
use experiment_file::ExperimentConfig;
use sim_core::{Simulation, TrialSet};

const N_GENOTYPES: u64 = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args().nth(1).ok_or("usage: evaluate EXPERIMENT")?;
    let text = fs::read_to_string(&path)?;
    let (config, _warnings) = ExperimentConfig::from_json(&text, "example", evolution::ALGORITHMS)?;
    let simulation = Simulation::compile(&config)?;
    let n_trials = config.algorithm.num_evaluations;
    for seed in 0..N_GENOTYPES {
        let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
        let genotype: Vec<f64> = (0..simulation.genotype_len()).map(|_| stream.uniform()).collect();
        // All genotypes meet the same worlds and the same noise.
        let fitness = simulation.evaluate(&genotype, TrialSet::Generation(0), 0..n_trials)?;
        let mean = fitness.iter().sum::<f64>() / f64::from(n_trials);
        println!("genotype {seed}: {mean:.6}, of its trials {fitness:.6?}");
    }
    Ok(())
}

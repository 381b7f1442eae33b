//! Watches an episode of a champion, and prints measures and robots step by step.
//!
//! ```sh
//! cargo run --release -p sim-core --example watch -- configs/leader_selection_snes.json \
//!     results/champions/leader_selection_snes-0.json
//! ```

use std::{env, error::Error, fs};

use experiment_file::ExperimentConfig;
use sim_core::{Simulation, TrialSet};

/// Steps between printed lines.
const EVERY: u32 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().skip(1).collect();
    let [experiment, champion] = &args[..] else {
        return Err("usage: watch EXPERIMENT CHAMPION".into());
    };
    let text = fs::read_to_string(experiment)?;
    let (config, _warnings) = ExperimentConfig::from_json(&text, "example", evolution::ALGORITHMS)?;
    let simulation = Simulation::compile(&config)?;
    let champion: serde_json::Value = serde_json::from_str(&fs::read_to_string(champion)?)?;
    let genotype: Vec<f64> = serde_json::from_value(champion["genotype"].clone())?;
    let summary = simulation.simulate(&genotype, TrialSet::Generation(0), 0, &mut |step| {
        if step.step.is_multiple_of(EVERY) {
            let leds: String =
                step.robots.iter().map(|robot| if robot.led > 0 { '*' } else { '.' }).collect();
            println!("step {:4}  LEDs {leds}  {:?}", step.step, step.measures);
        }
    })?;
    println!("fitness {:.6}; means {:?}", summary.fitness, summary.measures);
    Ok(())
}

//! The simulation, transcribed from its equations a second time: one robot at a time, plain
//! structs, dense matrices, `f64` throughout. The code is deliberately slow and obvious, because
//! tests compare the simulator with it.
//!
//! From the project, the code uses only the types of a configuration, and the random streams, whose
//! addresses and order of draws are part of the specification.
#![allow(
    clippy::disallowed_methods,
    reason = "independence from the simulator's arithmetic, libm included, is the point"
)]

mod actuators;
mod alpha_shape;
mod communication;
mod controller;
mod encoding;
mod fitness;
mod initializers;
mod learning;
mod lights;
mod network;
mod perturbations;
mod reality;
mod robot;
mod sensors;
mod spiking;
mod torus;
mod witness;
mod world;

pub use network::genes;
pub use witness::Witness;
pub use world::Simulation;

use experiment_file::ExperimentConfig;

/// An episode from its first to its last step.
pub struct Episode {
    /// Fitness of the trial.
    pub fitness: f64,
    /// The events of the episode.
    pub witness: Witness,
}

/// Simulates one trial of one genotype.
pub fn run(config: &ExperimentConfig, genotype: &[f64], generation: u64, trial: u32) -> Episode {
    let mut simulation = Simulation::new(config, genotype, generation, trial);
    let of_steps: Vec<f64> =
        (0..config.algorithm.evaluation_steps).map(|_| simulation.step()).collect();
    let fitness = fitness::of_trial(config.algorithm.fitness_function, &of_steps);
    Episode { fitness, witness: simulation.witness }
}

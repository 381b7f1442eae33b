//! The simulation of swarms of robots, as a pure function:
//! (experiment, genotype, trial set, trials) -> fitness of each trial.
//!
//! The crate uses no I/O, threads, clock, ambient randomness or platform libm, so the same inputs
//! give the same bits on every machine.
//!
//! # Example
//!
//! Five robots turn light into the speed of their wheels, with a network whose weights are the
//! genotype:
//!
//! ```
//! use experiment_file::ExperimentConfig;
//! use sim_core::{Simulation, TrialSet};
//!
//! let text = r#"{
//!   "topology": {
//!     "stimuli": {"light": {"n": 4, "sensor": "light_sensor"}},
//!     "ensembles": {"OUT": {"n": 2, "activation": "tanh"}},
//!     "synapses": {"in": {"pre": "light", "post": "OUT"}},
//!     "outputs": {"wheels": {"ensemble": "OUT", "actuator": "wheel_actuator"}},
//!     "decoding": {"wheels": {"scheme": "IdentityDecoding"}}
//!   },
//!   "algorithm": {
//!     "name": "SNES", "evolvable_object": "robot", "fitness_function": "goto_light",
//!     "population_size": 20, "generations": 10, "evaluation_steps": 50, "num_evaluations": 2,
//!     "populations": {
//!       "all": {"objects": ["synapses:weights:all"], "min_vals": -3, "max_vals": 3}
//!     }
//!   },
//!   "world": {"objects": {
//!     "robot": {
//!       "type": "robot", "num_instances": 5, "controller": "neural_controller",
//!       "sensors": {"light_sensor": {"n_sectors": 4}}, "actuators": {"wheel_actuator": {}},
//!       "initializers": {"positions": {"name": "random_uniform"}}
//!     },
//!     "lamp": {
//!       "type": "light_source", "num_instances": 1,
//!       "initializers": {"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}}
//!     }
//!   }}
//! }"#;
//! let (config, _warnings) = ExperimentConfig::from_json(text, "example", evolution::ALGORITHMS)?;
//! let simulation = Simulation::compile(&config)?;
//! assert_eq!(simulation.genotype_len(), 8);
//!
//! // The fitness of a genotype in two trials: the same bits wherever it is computed.
//! let genotype = [0.5; 8];
//! let fitness = simulation.evaluate(&genotype, TrialSet::Generation(0), 0..2)?;
//!
//! // The first of these episodes, step by step.
//! let mut positions = Vec::new();
//! let summary = simulation.simulate(&genotype, TrialSet::Generation(0), 0, &mut |step| {
//!     positions.push(step.robots[0].position);
//! })?;
//! assert_eq!(positions.len(), 50);
//! assert_eq!(summary.fitness, fitness[0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Where things are
//!
//! [`Simulation::compile`] turns a configuration into a `network`, a codec of genotypes
//! (`genotype`) and a `world` of `objects`. `episode` steps the trials of a genotype side by side
//! and shows them to a recorder. In `stepping`, the caller decides the robots' actions, and
//! `intervention` has what a watcher may change in the middle. `trial` has the phases of a step,
//! and `swarm` the state of the robots. Each phase is a module: `senses` and `sensors`,
//! `communication`, `controllers`, `perturbations`, `drive`, `lights`, `fitness`. All modules use
//! `determinism`'s random streams, `torus`, `neighbours` (robots within reach of each other), and
//! the arithmetic on vectors of robots: `lanes` has the vectors, `exp2` the base of activation
//! functions. [`blueprint`] exports a controller as numbers, and `testimony` what each robot
//! perceived and did, so that other programs can prove to do the same. `bench` opens the kernel to
//! the benchmarks.

mod alpha_shape;
#[doc(hidden)]
pub mod bench;
pub mod blueprint;
mod bodies;
mod border;
mod communication;
mod controllers;
mod descriptors;
mod drive;
mod episode;
mod exp2;
mod fitness;
mod genotype;
mod initializers;
mod intervention;
mod lanes;
mod leadership;
mod lights;
mod neighbours;
mod network;
mod objects;
mod output;
mod perturbations;
mod polar;
mod problems;
mod record;
mod script;
mod senses;
mod sensors;
mod simulation;
mod specified;
mod starts;
mod stepping;
mod swarm;
mod testimony;
#[cfg(test)]
mod testing;
mod torus;
mod trial;
mod world;

pub use communication::Mode;
pub use determinism::{Isa, UnknownIsa, random::TrialSet};
pub use intervention::{Act, INTERVENTIONS_MAX, Intervention, InterventionError, Thing};
pub use output::Output;
pub use record::{
    EpisodeSummary, MeasureName, Measures, MovableRecord, Outline, ReceivedFrame, RobotRecord,
    RoomRecord, StepRecord,
};
pub use simulation::{EvaluateError, Simulation};
pub use specified::{SpecifiedSimulation, panic_message, panic_to_failure};
pub use starts::{TRYING_TIME_MAX, Tried};
pub use stepping::{Actions, Policy, StepError, Stepper};
pub use testimony::{Frame, HeardFrame, RadioTestimony, Testimony};
pub use torus::Vec2;

/// Identifies the function that this crate computes. Its version is that of the first release that
/// computed this function. Later releases keep it, because the digests of runs cover it. Raise the
/// format number whenever any fitness bit may change: coordinator and workers work together only if
/// their fingerprints are equal.
pub const FINGERPRINT: &str = "sim-core 0.1.0 format 3";

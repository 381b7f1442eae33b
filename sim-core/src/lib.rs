//! The simulation of swarms of robots, as a pure function:
//! (experiment, genotype, trial set, trials) -> fitness of each trial.
//!
//! No I/O, no threads, no clock, no ambient randomness, no platform libm: the
//! same inputs give the same bits on every machine.
//!
//! Where things are: `experiment` compiles a configuration into a `network`, a
//! codec of genotypes (`genotype`) and a `world`; `episode` steps the trials of a
//! genotype side by side, `trial` has the phases of a step, and `swarm` the state
//! of its robots. A phase is a module each: `senses` and `sensors`,
//! `communication`, `controllers`, `perturbations`, `drive`, `lights`, `fitness`.
//! Below everything lie `random` and `torus`, `neighbours` (who is in reach of whom)
//! and the arithmetic on vectors of robots: `isa` picks the instruction set, `lanes`
//! are the vectors, `exp2` is what activations are made of. `bench` opens the kernel
//! to the benchmarks.

mod alpha_shape;
#[doc(hidden)]
pub mod bench;
mod border;
mod communication;
mod controllers;
mod drive;
mod episode;
mod exp2;
mod fitness;
mod genotype;
mod initializers;
mod lanes;
mod leadership;
mod lights;
mod neighbours;
mod network;
mod objects;
mod output;
mod perturbations;
mod problems;
mod record;
mod senses;
mod sensors;
mod simulation;
mod specified;
mod swarm;
#[cfg(test)]
mod testing;
mod torus;
mod trial;
mod world;

pub use communication::Mode;
pub use numeric::{Isa, UnknownIsa, random::TrialSet};
pub use output::Output;
pub use record::{EpisodeSummary, Metrics, ReceivedFrame, RobotRecord, StepRecord};
pub use simulation::{EvaluateError, Simulation};
pub use specified::{SpecifiedSimulation, panic_to_failure};
pub use torus::Vec2;

/// Identifies the function that this crate computes. Raise the number after the
/// version whenever any fitness bit may change: coordinator and workers work
/// together only if they agree on it.
pub const FINGERPRINT: &str = concat!("sim-core ", env!("CARGO_PKG_VERSION"), " format 2");

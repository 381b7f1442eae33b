//! `swarmctl simulate`.

use std::path::PathBuf;

use clap::{Args, value_parser};

use super::{IsaArgs, help};
use crate::{
    error::Error,
    experiment_file::{Compiled, ExperimentFile, Overrides},
};

/// What to simulate.
#[derive(Debug, Clone, Args)]
#[command(after_help = help::SIMULATE)]
pub struct SimulateArgs {
    /// The experiment file.
    pub config: PathBuf,
    /// File of the genotype: a JSON list of genes, or an object with a `genotype`,
    /// such as a champion file.
    ///
    /// Without it, and without --experiment, genes are drawn uniformly from the
    /// streams (seed, generation 0, trial 0, evolution, population): the first
    /// individual of a GA.
    #[arg(long, value_name = "FILE", conflicts_with = "experiment")]
    pub genotype: Option<PathBuf>,
    /// Take the champion of this experiment of the coordinator.
    #[arg(long, value_name = "ID")]
    pub experiment: Option<u64>,
    /// Seed of all randomness, instead of the file's.
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Generation, from 0, whose worlds to simulate.
    #[arg(long, value_name = "G", default_value_t = 0)]
    pub generation: u64,
    /// Number of trials, instead of the file's.
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub trials: Option<u32>,
    /// Number of steps per trial, instead of the file's.
    #[arg(long, value_name = "T", value_parser = value_parser!(u32).range(1..))]
    pub steps: Option<u32>,
    /// Write everything that every robot does to this CSV file.
    ///
    /// One row per trial, step and robot. Columns:
    ///
    ///   trial, step, robot       numbers, from 0
    ///   object                   the robot's object in the experiment file
    ///   x_cm, y_cm               position at the end of the step
    ///   heading_rad              heading at the end of the step, in [0, 2 pi)
    ///   wheel_right, wheel_left  actions, in [-1, 1]
    ///   led                      colour, 0 off
    ///   mode                     send or relay
    ///   message_0, ...           own message; on the air if the mode is send
    ///   frame_originator         robot whose message was received; empty if none
    ///   frame_hops               emissions of that message, from 1
    ///   frame_sector             sector that received it, from 0
    ///   frame_signal             its strength, in (0, 1]
    ///   stimulus_NAME_0, ...     inputs of the controller
    ///   light_0_x_cm, ...        positions of the lights during the step
    ///   step_fitness             fitness of the step; empty if it does not count
    ///   metric_NAME, ...         measures of the task in this step
    ///
    /// The last three kinds are the same for all robots of a step.
    #[arg(long, value_name = "FILE", verbatim_doc_comment)]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub isa: IsaArgs,
}

impl SimulateArgs {
    /// What to change.
    pub fn overrides(&self) -> Overrides {
        let Self { seed, steps, trials, .. } = *self;
        Overrides { seed, steps, trials, ..Overrides::default() }
    }

    /// What the file describes, changed.
    pub fn compiled(&self) -> Result<Compiled, Error> {
        let file = ExperimentFile::read(&self.config);
        let compiled = file.and_then(|file| file.compile(&self.overrides()));
        let compiled = compiled.map_err(|error| Error::invalid(&self.config, &error))?;
        Ok(Compiled { experiment: compiled.experiment.with_isa(self.isa.get()), ..compiled })
    }
}

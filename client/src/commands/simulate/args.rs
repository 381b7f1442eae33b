//! The arguments of `swarmctl simulate`.

use std::path::PathBuf;

use clap::{Args, value_parser};

use crate::{
    args::{IsaArgs, SeedArg, StepsArg},
    error::Error,
    experiment_file::{Compiled, ExperimentFile, Overrides},
};

/// Simulate single trials here, and show the fitness and measures of a genotype.
///
/// They are the same, bit for bit, as in evolution: a champion in the worlds of its
/// generation gets the fitness that is stored with it.
#[derive(Debug, Clone, Args)]
#[command(after_help = HELP)]
pub struct SimulateArgs {
    /// The experiment file.
    pub config: PathBuf,
    /// File with the genotype: a JSON list of genes, or an object with a `genotype`,
    /// such as a champion file.
    ///
    /// Without this option and without --experiment, genes are drawn uniformly from
    /// the streams (seed, generation 0, trial 0, evolution, population), as those of
    /// the first individual of a GA.
    #[arg(long, value_name = "FILE", conflicts_with = "experiment")]
    pub genotype: Option<PathBuf>,
    /// Use the champion of the coordinator's experiment with this number.
    #[arg(long, value_name = "ID")]
    pub experiment: Option<u64>,
    #[command(flatten)]
    pub seed: SeedArg,
    /// Generation, from 0, whose worlds to simulate.
    #[arg(long, value_name = "G", default_value_t = 0)]
    pub generation: u64,
    /// Number of trials, instead of the file's.
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub trials: Option<u32>,
    #[command(flatten)]
    pub steps: StepsArg,
    /// Write the state of every robot in every step to this CSV file.
    ///
    /// One row per trial, step and robot. Columns:
    ///
    ///   trial, step, robot       numbers, from 0
    ///   object                   the robot's object in the experiment file
    ///   x_cm, y_cm               position at the end of the step
    ///   heading_rad              heading at the end of the step, in [0, 2 pi)
    ///   wheel_right, wheel_left  actions, in [-1, 1]
    ///   led                      colour; 0 is off
    ///   mode                     send or relay
    ///   message_0, ...           own message; transmitted if the mode is send
    ///   frame_originator         robot whose message was received; empty if none
    ///   frame_hops               number of transmissions of that message, from 1
    ///   frame_sector             sector that received it, from 0
    ///   frame_signal             strength of its signal, in (0, 1]
    ///   stimulus_NAME_0, ...     inputs of the controller
    ///   light_0_x_cm, ...        positions of the lights during the step
    ///   step_fitness             fitness of the step; empty if the step is not scored
    ///   metric_NAME, ...         measures of the task in this step
    ///
    /// The last three kinds of columns are the same for all robots of a step.
    #[arg(long, value_name = "FILE", verbatim_doc_comment)]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub isa: IsaArgs,
}

const HELP: &str = "\
Examples:
  swarmctl simulate experiment.json --experiment 3 --trials 100
  swarmctl simulate experiment.json --genotype champion.json --trace trace.csv";

impl SimulateArgs {
    /// The replacements of values of the file.
    fn overrides(&self) -> Overrides {
        let Self { seed: SeedArg { seed }, steps: StepsArg { steps }, trials, .. } = *self;
        Overrides { seed, steps, trials, ..Overrides::default() }
    }

    /// Reads and compiles the file, with the replacements.
    pub fn compiled(&self) -> Result<Compiled, Error> {
        let file = ExperimentFile::read(&self.config);
        let compiled = file.and_then(|file| file.compile(&self.overrides()));
        let compiled = compiled.map_err(|error| Error::invalid(&self.config, &error))?;
        Ok(Compiled { experiment: compiled.experiment.with_isa(self.isa.get()), ..compiled })
    }
}

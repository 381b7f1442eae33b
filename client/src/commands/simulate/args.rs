//! The arguments of `swarmctl simulate`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;
use experiment_file::limits;

use super::trace::ExtraColumns;
use crate::{
    address::NamedAddress,
    args::{ChangedArg, FOREIGN, IsaArgs, SeedArg, StepsArg, whole},
    complete,
    error::Error,
    experiment_file::{Compiled, ExperimentFile, Overrides},
    output_file::Overwrite,
};

/// Simulate single trials here, and show the fitness and measures of a genotype.
///
/// The results equal those of evolution, bit for bit: in the worlds of its generation, a
/// champion gets its stored fitness.
#[derive(Debug, Clone, Args)]
#[command(after_help = HELP)]
pub struct SimulateArgs {
    /// The experiment file; or a genotype, which is simulated with the file of its experiment, in
    /// the worlds of its generation: ID or NAME, the champion; ID@G/I, individual I of generation
    /// G; ID@G/mean, the mean of the distribution after it; 'ID@G/cell(A,B)', the elite of a cell.
    #[arg(value_name = "CONFIG|ADDRESS", add = ArgValueCompleter::new(complete::experiments_and_files))]
    pub subject: PathBuf,
    /// File with the genotype: a JSON list of genes, or an object with a `genotype`,
    /// such as a champion file.
    ///
    /// Without this option, --experiment or an address, the command draws uniform genes from the
    /// streams (seed, generation 0, trial 0, evolution, population), as for the first individual
    /// of a GA.
    #[arg(long, value_name = "FILE", group = FOREIGN, conflicts_with = "experiment")]
    pub genotype: Option<PathBuf>,
    /// Use a genotype of an experiment: ID or NAME, the champion; ID@G/I, individual I of
    /// generation G; ID@G/mean, the mean of the distribution after it.
    #[arg(long, value_name = "ADDRESS", group = FOREIGN, add = ArgValueCompleter::new(complete::experiments))]
    pub experiment: Option<NamedAddress>,
    #[command(flatten)]
    pub changed: ChangedArg,
    #[command(flatten)]
    pub seed: SeedArg,
    /// Generation of the worlds to simulate, from 0 [default: that of the address; 0 for an
    /// experiment file]
    #[arg(long, value_name = "G", value_parser = whole(0..=u64::MAX))]
    pub generation: Option<u64>,
    /// Number of trials, instead of the file's.
    #[arg(long, value_name = "N", value_parser = whole(1..=limits::TRIALS))]
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
    /// Additional columns of the trace, after the others.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "COLUMNS", requires = "trace")]
    pub trace_columns: Vec<ExtraColumns>,
    #[command(flatten)]
    pub overwrite: Overwrite,
    #[command(flatten)]
    pub isa: IsaArgs,
}

const HELP: &str = "\
Examples:
  swarmctl simulate 3@5/7
  swarmctl simulate 3@5/7 --data-dir swarm-data --trace trace.csv
  swarmctl simulate experiment.json --experiment 3 --trials 100
  swarmctl simulate experiment.json --genotype champion.json --trace trace.csv";

impl SimulateArgs {
    /// The replacements of values of the file.
    fn overrides(&self) -> Overrides {
        let Self { seed: SeedArg { seed }, steps: StepsArg { steps }, trials, .. } = *self;
        Overrides { seed, steps, trials, ..Overrides::default() }
    }

    /// The address of the genotype to simulate, unless the subject is a file.
    pub fn address(&self) -> Option<NamedAddress> {
        let address = self.subject.to_str()?.parse().ok();
        address.filter(|_| !self.subject.exists())
    }

    /// Reads the experiment file.
    pub fn file(&self) -> Result<ExperimentFile, Error> {
        ExperimentFile::read(&self.subject)
    }

    /// Compiles an experiment file, with the replacements.
    pub fn compiled(&self, file: &ExperimentFile) -> Result<Compiled, Error> {
        let compiled = file.compile(&self.overrides()).map_err(|error| file.invalid(&error))?;
        Ok(Compiled { experiment: compiled.experiment.with_isa(self.isa.get()), ..compiled })
    }
}

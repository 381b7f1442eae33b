//! The command line.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum, value_parser};

use crate::{
    error::Error,
    experiment_file::{Compiled, ExperimentFile, Overrides},
};

/// Evolves controllers for swarms of robots.
#[derive(Debug, Parser)]
#[command(name = "swarmctl", version, after_help = AFTER_HELP)]
pub struct Args {
    /// Address of the coordinator; `run` brings its own.
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = "SWARM_COORDINATOR",
        default_value = "http://127.0.0.1:7700"
    )]
    pub coordinator: String,
    /// What standard output is for.
    #[arg(long, global = true, value_enum, default_value_t = OutputFormat::Text)]
    pub output: OutputFormat,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What standard output is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// For people.
    Text,
    /// For programs: `run`, `watch` and `submit --watch` print one object per
    /// line, the other commands one document.
    Json,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run an experiment in this process, from file to champion.
    ///
    /// Starts a coordinator and workers, the same as a fleet's, and follows the
    /// experiment to its end. Interrupted, it loses at most one generation: the
    /// same command continues it.
    Run(RunArgs),
    /// Check experiment files, here and without a coordinator.
    ///
    /// Prints a line per good file, and every problem of every bad one.
    Validate {
        /// The experiment files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Print the JSON Schema of experiment files, for editors that complete and
    /// check them.
    Schema,
    /// Simulate single episodes here, and show how well a genotype does.
    ///
    /// Fitness and measures are the same, bit for bit, as in evolution: a champion
    /// in the worlds of its generation gets the fitness that is stored with it.
    Simulate(SimulateArgs),
    #[command(flatten)]
    Remote(RemoteCommand),
}

/// What to ask a coordinator for.
#[derive(Debug, Subcommand)]
pub enum RemoteCommand {
    /// Give an experiment to the coordinator.
    Submit(SubmitArgs),
    /// List all experiments.
    List,
    /// Follow an experiment from its first generation to its end.
    Watch {
        /// Number of the experiment.
        id: u64,
    },
    /// End an experiment early; its history and champion stay.
    Cancel {
        /// Number of the experiment.
        id: u64,
    },
    /// Print the best genotype so far, its fitness, and the network that it
    /// encodes, as JSON.
    Champion {
        /// Number of the experiment.
        id: u64,
    },
}

/// What to run.
#[derive(Debug, ClapArgs)]
pub struct RunArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Number of workers, each computing one thing at a time [default: the
    /// number of cores]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub workers: Option<u16>,
    /// Where everything is stored.
    #[arg(long, value_name = "DIR", default_value = "./swarm-data")]
    pub data_dir: PathBuf,
}

/// What to submit.
#[derive(Debug, ClapArgs)]
pub struct SubmitArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Follow it to its end.
    #[arg(long)]
    pub watch: bool,
}

/// An experiment, and what to change in it.
#[derive(Debug, ClapArgs)]
pub struct ExperimentArgs {
    /// The experiment file.
    pub config: PathBuf,
    /// Number of generations, instead of the file's.
    #[arg(long, value_name = "G", value_parser = value_parser!(u64).range(1..))]
    pub generations: Option<u64>,
    /// Seed of all randomness, instead of the file's.
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
}

impl ExperimentArgs {
    /// What to change.
    pub fn overrides(&self) -> Overrides {
        let Self { seed, generations, .. } = *self;
        Overrides { seed, generations, ..Overrides::default() }
    }

    /// The file, if the experiment can be evolved.
    pub fn checked_file(&self) -> Result<ExperimentFile, Error> {
        let file = ExperimentFile::read(&self.config);
        let checked = file.and_then(|file| file.check(&self.overrides()).map(|_| file));
        checked.map_err(|error| Error::invalid(&self.config, &error))
    }
}

/// What to simulate.
#[derive(Debug, Clone, ClapArgs)]
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
        compiled.map_err(|error| Error::invalid(&self.config, &error))
    }
}

const AFTER_HELP: &str = "\
Examples:
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl watch 3 --output json | jq .best
  swarmctl champion 3 > champion.json
  swarmctl validate experiments/*.json
  swarmctl schema > experiment.schema.json
  swarmctl simulate experiment.json --genotype champion.json --trace trace.csv

JSON lines of run, watch and submit --watch: one per generation (numbered from
0), then one with state, digest and champion.

Exit codes:
  0    done
  1    internal error
  2    bad input: arguments, experiment file, genotype, data directory, trace file
  3    no such experiment, or it has no champion yet
  4    the coordinator cannot be reached
  5    the experiment failed or was cancelled (run, watch, submit --watch)
  130  interrupted";

#[cfg(test)]
mod tests {
    use clap::{CommandFactory as _, error::ErrorKind};

    use super::*;

    fn parse(line: &str) -> Result<Args, ErrorKind> {
        Args::try_parse_from(line.split(' ')).map_err(|error| error.kind())
    }

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn run_has_defaults() {
        let Command::Run(args) = parse("swarmctl run a.json").unwrap().command else { panic!() };
        assert_eq!(args.experiment.config, PathBuf::from("a.json"));
        assert_eq!(
            (args.workers, args.experiment.generations, args.experiment.seed),
            (None, None, None)
        );
        assert_eq!(args.data_dir, PathBuf::from("./swarm-data"));
    }

    #[test]
    fn global_options_stand_before_and_after_the_command() {
        for line in [
            "swarmctl --output json --coordinator http://h:1 list",
            "swarmctl list --output json --coordinator http://h:1",
        ] {
            let args = parse(line).unwrap();
            assert_eq!(args.output, OutputFormat::Json);
            assert_eq!(args.coordinator, "http://h:1");
        }
    }

    #[test]
    fn seeds_span_all_64_bits() {
        let line = format!("swarmctl submit a.json --seed {} --watch", u64::MAX);
        let Command::Remote(RemoteCommand::Submit(args)) = parse(&line).unwrap().command else {
            panic!()
        };
        assert_eq!(args.experiment.seed, Some(u64::MAX));
        assert!(args.watch);
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused() {
        for line in [
            "swarmctl run a.json --workers 0",
            "swarmctl run a.json --workers 1025",
            "swarmctl run a.json --generations 0",
            "swarmctl submit a.json --seed -1",
            "swarmctl watch first",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}

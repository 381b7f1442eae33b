//! The command line.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum, value_parser};

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

const AFTER_HELP: &str = "\
Examples:
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl watch 3 --output json | jq .best
  swarmctl champion 3 > champion.json

JSON lines of run, watch and submit --watch: one per generation (numbered from
0), then one with state, digest and champion.

Exit codes:
  0    done
  1    internal error
  2    bad input: arguments, experiment file, data directory
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

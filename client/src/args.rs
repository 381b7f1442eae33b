//! The command line: the options of all commands, and the arguments that several
//! commands share. Each command's own arguments are in its module.

use std::path::PathBuf;

use clap::{Args as ClapArgs, Parser, ValueEnum, value_parser};
use sim_core::Isa;

use crate::{
    commands::Command,
    error::Error,
    experiment_file::{ExperimentFile, Overrides},
    settings::Settings,
};

/// Evolves controllers for swarms of robots.
#[derive(Debug, Parser)]
#[command(name = "swarmctl", version, after_help = HELP, max_term_width = 100)]
pub struct Args {
    /// Format of standard output.
    #[arg(
        long,
        short,
        alias = "format",
        global = true,
        value_enum,
        default_value_t = OutputFormat::Table,
        value_name = "FORMAT"
    )]
    pub output: OutputFormat,
    #[command(flatten)]
    pub settings: Settings,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// Format of standard output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// For people: tables fit the terminal; NO_COLOR turns colours off.
    #[value(alias = "text")]
    Table,
    /// As table, with all columns, and nothing cut off.
    Wide,
    /// For programs: `run`, `watch`, `wait`, `logs` and `submit --watch` print one
    /// object per line, the other commands one document.
    Json,
    /// For spreadsheets: `list`, `history` and `workers` only.
    Csv,
}

/// Below the list of commands.
const HELP: &str = "\
Examples:
  swarmctl validate experiments/*.json
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl explain 3
  swarmctl history 3 --output csv > history.csv
  swarmctl champion 3 > champion.json

The connection to the coordinator is configured by the options, else by their
environment variables, else by the settings file. SWARM_CONFIG names that file;
the default is ~/.config/swarmevo/config.json. For example:
  {\"coordinator\": \"https://fleet.example:7700\", \"tls-ca\": \"ca.pem\",
   \"token-file\": \"client.token\"}

Exit codes:
  0    success
  1    internal error
  2    bad input: arguments, settings, a token, a certificate, a genotype, an
       experiment file, a directory, a file to write
  3    no such experiment, or its state does not allow the request (no champion
       yet, ended)
  4    the coordinator cannot be reached
  5    the experiment failed (run, watch, wait, submit --watch)
  6    the experiment was cancelled (the same commands)
  7    the coordinator does not accept the token
  8    no TLS connection: one side has no TLS, or the certificate is not trusted
  9    the server at the address is not a coordinator, or one of another version
  10   the experiment has not ended within wait --timeout
  11   the database is damaged (doctor, backup)
  130  interrupted";

/// The experiment that a command is about.
#[derive(Debug, ClapArgs)]
pub struct ExperimentId {
    /// Number of the experiment.
    pub id: u64,
}

/// An experiment file to evolve, and replacements of its values.
#[derive(Debug, ClapArgs)]
pub struct ExperimentArgs {
    /// The experiment file.
    pub config: PathBuf,
    /// Number of generations, instead of the file's.
    #[arg(long, value_name = "G", value_parser = value_parser!(u64).range(1..))]
    pub generations: Option<u64>,
    #[command(flatten)]
    pub seed: SeedArg,
}

impl ExperimentArgs {
    /// The replacements.
    pub fn overrides(&self) -> Overrides {
        let Self { seed: SeedArg { seed }, generations, .. } = *self;
        Overrides { seed, generations, ..Overrides::default() }
    }

    /// Reads the file; fails if the experiment cannot be evolved.
    pub fn checked_file(&self) -> Result<ExperimentFile, Error> {
        let file = ExperimentFile::read(&self.config);
        let checked = file.and_then(|file| file.check(&self.overrides()).map(|_| file));
        checked.map_err(|error| Error::invalid(&self.config, &error))
    }
}

/// The data directory of a coordinator.
#[derive(Debug, ClapArgs)]
pub struct DataDirArg {
    /// The data directory of a coordinator, or of `run`.
    #[arg(long, env = "SWARM_DATA_DIR", value_name = "DIR", default_value = "./swarm-data")]
    pub data_dir: PathBuf,
}

/// A replacement of the file's seed.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct SeedArg {
    /// Seed of all randomness, instead of the file's.
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
}

/// A replacement of the file's length of a trial.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct StepsArg {
    /// Number of steps per trial, instead of the file's.
    #[arg(long, value_name = "T", value_parser = value_parser!(u32).range(1..))]
    pub steps: Option<u32>,
}

/// Vector instructions of the simulation.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct IsaArgs {
    /// Vector instructions: portable, avx2, avx512 or neon. They change the speed and
    /// no bit of the results [default: the fastest that this processor has]
    #[arg(long, env = "SWARM_ISA", value_name = "LEVEL")]
    isa: Option<Isa>,
}

impl IsaArgs {
    /// The level to use.
    pub fn get(self) -> Isa {
        self.isa.unwrap_or_else(Isa::best)
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory as _, error::ErrorKind};

    use super::*;
    use crate::commands::RemoteCommand;

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
        assert_eq!(args.experiment.overrides(), Overrides::default());
        assert_eq!(args.workers, None);
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
            assert_eq!(args.settings.coordinator.as_deref(), Some("http://h:1"));
        }
    }

    #[test]
    fn seeds_span_all_64_bits() {
        let line = format!("swarmctl submit a.json --seed {} --watch", u64::MAX);
        let Command::Remote(RemoteCommand::Submit(args)) = parse(&line).unwrap().command else {
            panic!()
        };
        assert_eq!(args.experiment.overrides().seed, Some(u64::MAX));
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
            "swarmctl wait 1 --timeout 5",
            "swarmctl wait 1 --timeout s",
            "swarmctl wait 1 --timeout 99999999999h",
            "swarmctl logs --from 3",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}

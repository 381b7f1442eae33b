//! The command line: the options of all commands, and the arguments that several
//! commands share. Each command's own arguments are in its module.

use std::{
    fmt::{self, Display},
    ops::RangeInclusive,
    path::PathBuf,
    str::FromStr,
    thread,
};

use clap::{ArgAction, Args as ClapArgs, Parser, ValueEnum};
use clap_complete::ArgValueCompleter;
use experiment_file::limits;
use model::{group, labels};
use sim_core::Isa;
use swarm_telemetry::VERSION;

use crate::{
    commands::Command,
    complete,
    error::Error,
    examples::{self, Example},
    experiment_file::{ExperimentFile, Overrides},
    help::WIDTH_MAX,
    settings::Settings,
    sweep::SweepArgs,
};

/// Evolves controllers for swarms of robots.
#[derive(Debug, Parser)]
#[command(name = "swarmctl", version = VERSION, max_term_width = WIDTH_MAX)]
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
    /// Say more while experiments are followed: digests of generations, and what is optimistic.
    #[arg(long, short, global = true)]
    pub verbose: bool,
    /// Print help with all options, also those that say where experiments are: --data-dir,
    /// --coordinator, tokens and certificates.
    #[arg(long, global = true, action = ArgAction::HelpLong)]
    pub help_all: Option<bool>,
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
pub const EXAMPLES: &str = "\
Examples:
  swarmctl validate experiments/*.json
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl explain 3
  swarmctl history 3 --output csv > history.csv
  swarmctl champion 3 > champion.json";

/// Below the examples, on the long page.
pub const MORE: &str = "\
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
  11   the database is damaged
  12   the bundle is not what it says (verify)
  71   the system gives it too few threads or file descriptors, or too little memory
  130  interrupted
  141  standard output was closed (watch, logs, help); the other commands go on without it";

/// The experiment, or the group of them, that a command is about.
#[derive(Debug, ClapArgs)]
pub struct Target {
    /// Number or name of the experiment, or name of a group of experiments.
    #[arg(value_name = "ID|NAME", add = ArgValueCompleter::new(complete::experiments))]
    pub subject: Subject,
}

/// A label: `KEY=VALUE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    pub key: String,
    pub value: String,
}

impl FromStr for Label {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (key, value) = text.split_once('=').ok_or("expected KEY=VALUE")?;
        let (key, value) = (key.to_owned(), value.to_owned());
        labels::check(&[(key.clone(), value.clone())].into())?;
        Ok(Self { key, value })
    }
}

/// What a command is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    Experiment(u64),
    Group(String),
}

impl Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Experiment(id) => id.fmt(f),
            Self::Group(name) => name.fmt(f),
        }
    }
}

impl FromStr for Subject {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(id) = text.parse() {
            return Ok(Self::Experiment(id));
        }
        group::check_name(text)?;
        Ok(Self::Group(text.to_owned()))
    }
}

/// An experiment file to evolve, and replacements of its values.
#[derive(Debug, ClapArgs)]
pub struct ExperimentArgs {
    /// The experiment file; - is standard input.
    #[arg(required_unless_present = "example")]
    config: Option<PathBuf>,
    /// Evolve an experiment that is part of this program, instead of a file: `swarmctl examples`
    /// lists them.
    #[arg(long, value_name = "NAME", conflicts_with = "config", value_parser = examples::parser(), hide_possible_values = true)]
    example: Option<&'static Example>,
    /// Number of generations, instead of the file's.
    #[arg(long, value_name = "G", value_parser = whole(1..=limits::GENERATIONS))]
    pub generations: Option<u64>,
    #[command(flatten)]
    pub seed: SeedArg,
    #[command(flatten)]
    pub sweep: SweepArgs,
    /// Label it, to find it by: `list --label KEY=VALUE`; may be given several times.
    #[arg(long = "label", value_name = "KEY=VALUE", add = ArgValueCompleter::new(complete::labels))]
    pub labels: Vec<Label>,
}

impl ExperimentArgs {
    /// An experiment file, and nothing that replaces its values.
    #[cfg(test)]
    pub fn of(config: PathBuf) -> Self {
        Self {
            config: Some(config),
            example: None,
            generations: None,
            seed: SeedArg::default(),
            sweep: SweepArgs::default(),
            labels: Vec::new(),
        }
    }

    /// Reads the experiment file.
    pub fn file(&self) -> Result<ExperimentFile, Error> {
        match (&self.config, self.example) {
            (_, Some(example)) => Ok(example.file()),
            (Some(path), None) => {
                ExperimentFile::read(path).map_err(|error| Error::invalid(path, &error))
            }
            (None, None) => unreachable!("the command line requires one of them"),
        }
    }

    /// The words of a command line that name the experiment.
    pub fn words(&self) -> Vec<String> {
        match (&self.config, self.example) {
            (_, Some(example)) => vec!["--example".into(), example.name.into()],
            (Some(path), None) => vec![path.to_string_lossy().into_owned()],
            (None, None) => Vec::new(),
        }
    }

    /// The replacements.
    pub fn overrides(&self) -> Overrides {
        let Self { seed: SeedArg { seed }, generations, .. } = *self;
        Overrides { seed, generations, ..Overrides::default() }
    }
}

/// A replacement of the file's seed.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct SeedArg {
    /// Seed of all randomness, instead of the file's.
    #[arg(long, value_name = "S", value_parser = whole(0..=u64::MAX))]
    pub seed: Option<u64>,
}

/// A replacement of the file's length of a trial.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct StepsArg {
    /// Number of steps per trial, instead of the file's.
    #[arg(long, value_name = "T", value_parser = whole(1..=limits::STEPS))]
    pub steps: Option<u32>,
}

/// The group of options that take a genotype from elsewhere than the experiment file.
pub const FOREIGN: &str = "foreign";

/// Whether a genotype meets another experiment file than that in which it was evolved.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct ChangedArg {
    /// Take a genotype with an experiment file in which it was not evolved; without this
    /// option that is refused.
    #[arg(long, requires = FOREIGN)]
    pub changed_conditions: bool,
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

/// As many threads or workers as this machine has cores.
pub fn cores() -> usize {
    thread::available_parallelism().map_or(1, Into::into)
}

/// Reads a whole number of a range, for errors that say what would be right.
pub fn whole<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Copy + Display + Send + Sync + 'static,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            format!("must be a whole number from {} to {}", range.start(), range.end())
        })
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
        assert_eq!(args.experiment.words(), ["a.json"]);
        assert_eq!(args.experiment.overrides(), Overrides::default());
        assert_eq!(args.workers, None);
    }

    #[test]
    fn an_example_stands_for_a_file() {
        for name in ["leader_selection_snes", "leader_selection"] {
            let line = format!("swarmctl run --example {name} --generations 3");
            let Command::Run(args) = parse(&line).unwrap().command else { panic!() };
            assert_eq!(args.experiment.words(), ["--example", "leader_selection_snes"]);
            let file = args.experiment.file().unwrap();
            assert_eq!(file.name().as_deref(), Some("leader_selection_snes"));
        }
        let kinds =
            ["swarmctl run", "swarmctl run a.json --example chain", "swarmctl run --example x"]
                .map(|line| parse(line).unwrap_err());
        let expected = [
            ErrorKind::MissingRequiredArgument,
            ErrorKind::ArgumentConflict,
            ErrorKind::InvalidValue,
        ];
        assert_eq!(kinds, expected);
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
            "swarmctl simulate a.json --steps 200000",
            "swarmctl simulate a.json --trials 1001",
            "swarmctl watch first/second",
            "swarmctl watch -1",
            "swarmctl wait 1 --timeout 5",
            "swarmctl wait 1 --timeout s",
            "swarmctl wait 1 --timeout 99999999999h",
            "swarmctl logs --from 3",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}

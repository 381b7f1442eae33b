//! The command line: its commands, the options of all of them, and the text below them in the
//! help.

use clap::{ArgAction, Parser};
use swarm_telemetry::VERSION;
use textwrap::Options;

use crate::{
    commands::Command, error::EXIT_CODES, output_format::OutputFormat, settings::Settings,
};

/// Longest lines of help.
pub const WIDTH_MAX: usize = 100;

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
    /// Print more while following experiments: digests of generations, and optimistic fitness.
    #[arg(long, short, global = true)]
    pub verbose: bool,
    /// Print help with all options, including those that locate experiments: --data-dir,
    /// --coordinator, tokens and certificates.
    #[arg(long, global = true, action = ArgAction::HelpLong)]
    pub help_all: Option<bool>,
    #[command(flatten)]
    pub settings: Settings,
    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The text below the list of commands.
pub const EXAMPLES: &str = "\
Examples:
  swarmctl validate experiments/*.json
  swarmctl run experiment.json --generations 20
  swarmctl submit experiment.json --seed 7 --watch
  swarmctl explain 3
  swarmctl history 3 --output csv > history.csv
  swarmctl champion 3 > champion.json";

/// The settings file, on the long page of help.
const SETTINGS: &str = "\
The connection to the coordinator comes from options, else from environment
variables, else from the settings file. SWARM_CONFIG names that file; the
default is ~/.config/swarmevo/config.json. For example:
  {\"coordinator\": \"https://fleet.example:7700\", \"tls-ca\": \"ca.pem\",
   \"token-file\": \"client.token\"}";

/// Longest lines of the list of exit codes.
const LIST_WIDTH: usize = 80;

/// The text below the examples, on the long page of help.
pub fn more() -> String {
    let mut lines = [SETTINGS, "", "Exit codes:", "  0    success"].map(str::to_owned).to_vec();
    lines.extend(EXIT_CODES.iter().flat_map(|(code, about)| {
        let first = format!("  {code:<3}  ");
        let indents = Options::new(LIST_WIDTH).initial_indent(&first).subsequent_indent("       ");
        textwrap::wrap(about, indents).into_iter().map(Into::into).collect::<Vec<String>>()
    }));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory as _, error::ErrorKind};

    use super::*;
    use crate::{
        commands::{RemoteCommand, submit::Evolve},
        experiment_file::Overrides,
    };

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
    fn the_words_of_an_experiment_have_every_option_that_changes_it() {
        for words in [
            "a.json --generations 20 --seed 7 --set world.height=500 --set world.width=700",
            "a.json --seeds 0..4,9 --group sizes --set algorithm.population_size=50,100",
            "a.json --label user=ada --label purpose=thesis",
        ] {
            let args = parse(&format!("swarmctl run {words}")).unwrap();
            let Command::Run(args) = args.command else { panic!() };
            assert_eq!(args.experiment.words().join(" "), words);
        }
    }

    #[test]
    fn an_example_stands_for_a_file() {
        for name in ["leader_selection_snes", "leader_selection"] {
            let line = format!("swarmctl run --example {name} --generations 3");
            let Command::Run(args) = parse(&line).unwrap().command else { panic!() };
            let words = ["--example", "leader_selection_snes", "--generations", "3"];
            assert_eq!(args.experiment.words(), words);
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
        let Command::Remote(RemoteCommand::Evolve(Evolve::Submit(args))) =
            parse(&line).unwrap().command
        else {
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

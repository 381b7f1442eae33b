//! The command line.

mod evaluate;
mod help;
mod plot;
mod simulate;

use std::{path::PathBuf, time::Duration};

use clap::{Args as ClapArgs, Parser, Subcommand, ValueEnum, value_parser};
use clap_complete::Shell;
use sim_core::Isa;

use crate::{
    error::Error,
    experiment_file::{ExperimentFile, Overrides},
    settings::Settings,
};

pub use evaluate::EvaluateArgs;
pub use plot::PlotArgs;
pub use simulate::SimulateArgs;

/// Evolves controllers for swarms of robots.
#[derive(Debug, Parser)]
#[command(name = "swarmctl", version, after_help = help::SWARMCTL, max_term_width = 100)]
pub struct Args {
    /// What standard output is for.
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
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What standard output is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OutputFormat {
    /// For people: tables fit the terminal, colours obey `NO_COLOR`.
    #[value(alias = "text")]
    Table,
    /// For people who want to see it all: more columns, nothing cut.
    Wide,
    /// For programs: `run`, `watch`, `wait`, `logs` and `submit --watch` print one
    /// object per line, the other commands one document.
    Json,
    /// For spreadsheets: `list`, `history` and `workers` only.
    Csv,
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
    /// Check experiment files, here and without a coordinator.
    ///
    /// Prints a line per good file, and every problem of every bad one.
    Validate {
        /// The experiment files.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
    },
    /// Print the JSON Schema of experiment files.
    ///
    /// For editors that complete and check them.
    Schema,
    /// Simulate single episodes here, and show how well a genotype does.
    ///
    /// Fitness and measures are the same, bit for bit, as in evolution: a champion
    /// in the worlds of its generation gets the fitness that is stored with it.
    Simulate(SimulateArgs),
    /// Evaluate a genotype: many episodes under several conditions, every step measured.
    ///
    /// The episodes are the same for every genotype and condition, and no evolution
    /// has met them. There is always the nominal condition, which is the experiment
    /// file as it is; each of the other options adds conditions beside it. Measures
    /// and their statistics go to a directory: steps.csv, trials.csv, summary.json.
    /// They are the same, byte by byte, whoever computes them.
    #[command(after_help = help::EVALUATE)]
    Evaluate(EvaluateArgs),
    /// Draw the fitness of runs against their generations.
    ///
    /// A curve per run: the mean over the individuals of each generation, in a band
    /// from the worst to the best of them. The same runs give the same file, byte by
    /// byte.
    #[command(after_help = help::PLOT)]
    Plot(PlotArgs),
    /// Measure how fast this machine simulates an experiment.
    ///
    /// Every core evaluates random genotypes for some seconds. Says how long the
    /// whole experiment will take here, and on larger fleets.
    #[command(after_help = help::BENCH)]
    Bench(BenchArgs),
    /// Print a script with which a shell completes this program's command line.
    #[command(after_help = help::COMPLETIONS)]
    Completions {
        /// The shell.
        shell: Shell,
    },
}

impl Command {
    /// Whether what it prints is a table, and so can be CSV.
    pub fn has_table(&self) -> bool {
        use RemoteCommand::{History, List, Workers};
        matches!(self, Self::Remote(List | History { .. } | Workers))
    }
}

/// What to ask a coordinator for.
#[derive(Debug, Subcommand)]
pub enum RemoteCommand {
    /// Give an experiment to the coordinator.
    Submit(SubmitArgs),
    /// List all experiments.
    List,
    /// Follow an experiment from its first generation to its end.
    ///
    /// Generations that are complete already are shown first. A coordinator that
    /// goes away is waited for, up to a minute. Interrupting this does not
    /// interrupt the experiment.
    #[command(after_help = help::WATCH)]
    Watch {
        /// Number of the experiment.
        id: u64,
    },
    /// Wait until an experiment ends.
    Wait(WaitArgs),
    /// Print what has happened to an experiment, or to all of them.
    ///
    /// Generations, changes of state, and what else is worth a line, such as a
    /// champion's re-evaluation.
    Logs(LogsArgs),
    /// Print every completed generation of an experiment.
    #[command(after_help = help::HISTORY)]
    History {
        /// Number of the experiment.
        id: u64,
    },
    /// Print the best genotype so far and the network that it encodes, as JSON.
    ///
    /// `fitness` is that on held-out trials, which selected nothing, as soon as
    /// there have been some; `fitness_when_chosen` is that for which it was chosen.
    #[command(after_help = help::CHAMPION)]
    Champion {
        /// Number of the experiment.
        id: u64,
    },
    /// Say why nothing happens to an experiment, and what to do about it.
    ///
    /// No workers, paused, queued behind others, waiting at the barrier for the
    /// last items of a generation, failing items, a full disk: the coordinator
    /// knows, and this prints it on one screen, with the next steps.
    Explain {
        /// Number of the experiment.
        id: u64,
    },
    /// List the connected workers.
    ///
    /// Results per second and the idle share of their slots are those of the last
    /// minute. `items` is what a worker has in hand. A worker that is distrusted has
    /// returned other bits than others did; `--output wide` says which.
    Workers,
    /// Take an experiment's work from the workers until it is resumed.
    ///
    /// It stays paused when the coordinator is started again, and goes on with
    /// `swarmctl resume`. The pause changes no bit of what the experiment computes.
    Pause {
        /// Number of the experiment.
        id: u64,
        /// Why, for whoever finds it paused.
        #[arg(long, value_name = "TEXT")]
        reason: Option<String>,
    },
    /// Let a paused experiment go on.
    Resume {
        /// Number of the experiment.
        id: u64,
    },
    /// Change an experiment's share of the fleet.
    ///
    /// While several experiments have work to hand out, each gets a share of the
    /// workers' time in proportion to its priority.
    Priority {
        /// Number of the experiment.
        id: u64,
        /// Its new priority, 1 to 1000; 100 is what experiments begin with.
        #[arg(value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
        priority: u32,
    },
    /// End an experiment early; its history and champion stay.
    Cancel {
        /// Number of the experiment.
        id: u64,
    },
}

/// What to wait for.
#[derive(Debug, ClapArgs)]
#[command(after_help = help::WAIT)]
pub struct WaitArgs {
    /// Number of the experiment.
    pub id: u64,
    /// Which end is success.
    #[arg(long = "for", value_enum, default_value_t = WaitFor::Completed, value_name = "END")]
    pub target: WaitFor,
    /// Wait no longer than this: 90s, 15m, 2h [default: for ever]
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub timeout: Option<Duration>,
}

/// Which end is success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WaitFor {
    /// All generations done, or the target fitness reached.
    Completed,
    /// Any: it is enough that the experiment goes on no more.
    Ended,
}

/// Which log to print.
#[derive(Debug, ClapArgs)]
#[command(after_help = help::LOGS)]
pub struct LogsArgs {
    /// Number of the experiment [default: all, in the order of time]
    pub id: Option<u64>,
    /// Go on with what happens next; of one experiment, until it ends.
    #[arg(long, short)]
    pub follow: bool,
    /// Begin with the event of this sequence number.
    #[arg(long = "from", value_name = "SEQ", default_value_t = 1, requires = "id")]
    pub from_sequence: u64,
}

/// A time with its unit.
fn duration(text: &str) -> Result<Duration, String> {
    let n_digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let (number, unit) = text.split_at(n_digits);
    let unit_s = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3600,
        _ => return Err("expected a number and its unit: 90s, 15m or 2h".into()),
    };
    let number: u32 = number.parse().map_err(|_| "expected a number that is not so large")?;
    Ok(Duration::from_secs(u64::from(number) * unit_s))
}

/// What to run.
#[derive(Debug, ClapArgs)]
#[command(after_help = help::RUN)]
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
    #[command(flatten)]
    pub isa: IsaArgs,
}

/// What to submit.
#[derive(Debug, ClapArgs)]
#[command(after_help = help::SUBMIT)]
pub struct SubmitArgs {
    #[command(flatten)]
    pub experiment: ExperimentArgs,
    /// Its share of the fleet, 1 to 1000, beside other experiments [default: 100]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub priority: Option<u32>,
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
        let checked = file.and_then(|file| file.compile(&self.overrides()).map(|_| file));
        checked.map_err(|error| Error::invalid(&self.config, &error))
    }
}

/// What to measure.
#[derive(Debug, ClapArgs)]
pub struct BenchArgs {
    /// The experiment file [default: the thesis's leader selection, by SNES]
    pub config: Option<PathBuf>,
    /// How long to measure.
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = value_parser!(u16).range(1..))]
    pub seconds: u16,
    /// Number of cores to keep busy [default: all]
    #[arg(long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub cores: Option<u16>,
    #[command(flatten)]
    pub isa: IsaArgs,
}

/// With what to compute.
#[derive(Debug, Clone, Copy, Default, ClapArgs)]
pub struct IsaArgs {
    /// Vector instructions: portable, avx2, avx512 or neon. They change how fast it
    /// is, and no bit [default: the best of this processor]
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
            assert_eq!(args.settings.coordinator.as_deref(), Some("http://h:1"));
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
            "swarmctl wait 1 --timeout 5",
            "swarmctl wait 1 --timeout s",
            "swarmctl wait 1 --timeout 99999999999h",
            "swarmctl logs --from 3",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}

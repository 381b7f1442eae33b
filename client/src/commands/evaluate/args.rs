//! The arguments of `swarmctl evaluate`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;
use experiment_file::limits;

use crate::{
    address::NamedAddress,
    args::{ChangedArg, FOREIGN, IsaArgs, StepsArg, whole},
    change::SetArg,
    complete,
    output_file::Overwrite,
};

/// Evaluate a genotype: many trials under several conditions, every step measured.
///
/// The trials are the same for every genotype and condition, and no evolution uses
/// them. The command always evaluates the nominal condition, the unchanged experiment
/// file; the options below add more conditions. The command writes measures and their
/// statistics to a directory: steps.csv, trials.csv, summary.json. The files are the
/// same, byte by byte, on any fleet.
#[derive(Debug, Clone, Args)]
#[command(after_help = HELP)]
pub struct EvaluateArgs {
    /// The genotype to evaluate, with the file of its experiment: ID or NAME, the champion;
    /// ID@G/I, individual I of generation G; ID@G/mean, the mean of the distribution after it;
    /// 'ID@G/cell(A,B)', the elite of a cell.
    #[arg(value_name = "ADDRESS", add = ArgValueCompleter::new(complete::experiments), required_unless_present = "genotype")]
    pub address: Option<NamedAddress>,
    /// File with the genotype, such as a champion file.
    #[arg(long, value_name = "FILE", group = FOREIGN, conflicts_with = "address", requires = "config")]
    pub genotype: Option<PathBuf>,
    /// The experiment file that goes with --genotype.
    #[arg(long, value_name = "FILE", requires = "genotype")]
    pub config: Option<PathBuf>,
    #[command(flatten)]
    pub changed: ChangedArg,
    /// Number of trials per condition.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = whole(1..=limits::TRIALS))]
    pub trials: u32,
    #[command(flatten)]
    pub steps: StepsArg,
    /// Add a condition for each of these numbers of robots. The world keeps its size.
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    pub robots: Vec<u32>,
    /// Add a condition with a perturbation: leader_failure, topology_switch,
    /// uncontrollable_rotation or stimuli_inhibition. Other parameters keep their
    /// defaults.
    #[arg(long, value_name = "NAME[:KEY=VALUE,...]")]
    pub perturb: Vec<String>,
    /// Add a condition for each of these stimuli, in which the network receives zeros
    /// instead. Name a stimulus by its key in the file or by its sensor, such as
    /// wireless_receiver:msg or msg.
    #[arg(long, value_name = "STIMULUS,...", value_delimiter = ',')]
    pub inhibit: Vec<String>,
    /// Add N conditions, each a world unlike the one of the design, and a condition per
    /// cause; shows how much fitness they cost.
    ///
    /// The nominal condition is then the file without `pseudo_reality`. The numbers of each
    /// reality come from the ranges of the file's own `pseudo_reality`, or from default
    /// ranges; the seed of the file determines them.
    #[arg(long, value_name = "N", value_parser = whole::<u32>(3..=60))]
    pub pseudo_realities: Option<u32>,
    #[command(flatten)]
    pub set: SetArg,
    /// Like --set with one value per path, but for all conditions, including the nominal
    /// one.
    #[arg(long, value_name = "PATH=VALUE[;...]")]
    pub base: Vec<String>,
    /// Write every K-th step, and the last one, to steps.csv.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = whole(1..=limits::STEPS))]
    pub every: u32,
    /// Share of the fleet relative to experiments, 1 to 1000 [default: 100]
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=1000))]
    pub priority: Option<u32>,
    /// Compute in this process, with its own coordinator and workers, as `run` does.
    #[arg(long)]
    pub local: bool,
    /// Number of workers of --local [default: the number of cores]
    #[arg(long, value_name = "N", requires = "local", value_parser = whole::<u16>(1..=1024))]
    pub workers: Option<u16>,
    /// Directory of the results, created if missing.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    #[command(flatten)]
    pub isa: IsaArgs,
}

const HELP: &str = "\
docs/evaluation.md explains files, measures and statistics.

Examples:
  swarmctl evaluate 3@59/mean --data-dir swarm-data --local --to mean
  swarmctl evaluate 3 --robots 5,10,20,30,50 --to leader/scalability
  swarmctl evaluate 3 --perturb leader_failure:time_to_failure=50 --to leader/fault
  swarmctl evaluate 3 --pseudo-realities 30 --to leader/realities
  swarmctl evaluate 3 --inhibit msg,receiving_direction,state --to leader/stimuli
  swarmctl evaluate 5 --steps 2000 --to light/path \\
      --set world.objects.light_red.controller=light_rnd_pos_controller
  swarmctl evaluate --genotype champion.json --config experiment.json --local --to out";

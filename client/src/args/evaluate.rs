//! `swarmctl evaluate`.

use std::path::PathBuf;

use clap::{Args, value_parser};

use super::IsaArgs;

/// What to evaluate.
#[derive(Debug, Clone, Args)]
pub struct EvaluateArgs {
    /// Number of an experiment of the coordinator: its champion and its file.
    #[arg(required_unless_present = "genotype")]
    pub id: Option<u64>,
    /// File of the genotype, such as a champion file.
    #[arg(long, value_name = "FILE", conflicts_with = "id", requires = "config")]
    pub genotype: Option<PathBuf>,
    /// The experiment file that goes with --genotype.
    #[arg(long, value_name = "FILE", requires = "genotype")]
    pub config: Option<PathBuf>,
    /// Episodes per condition.
    #[arg(long, value_name = "N", default_value_t = 50, value_parser = value_parser!(u32).range(1..=1000))]
    pub trials: u32,
    /// Steps per episode, instead of the file's.
    #[arg(long, value_name = "T", value_parser = value_parser!(u32).range(1..))]
    pub steps: Option<u32>,
    /// A condition for each of these sizes of the swarm. The world keeps its size.
    #[arg(long, value_name = "N,...", value_delimiter = ',')]
    pub robots: Vec<u32>,
    /// A condition with a perturbation: leader_failure, topology_switch,
    /// uncontrollable_rotation, stimuli_inhibition; with parameters or defaults.
    #[arg(long, value_name = "NAME[:KEY=VALUE,...]")]
    pub perturb: Vec<String>,
    /// A condition for each of these stimuli: the network gets zeros for it. A name
    /// of the file's stimuli, or their sensor, such as wireless_receiver:msg or msg.
    #[arg(long, value_name = "STIMULUS,...", value_delimiter = ',')]
    pub inhibit: Vec<String>,
    /// A condition with something else in the experiment file; several changes are
    /// separated by semicolons.
    #[arg(long, value_name = "PATH=VALUE[;...]")]
    pub set: Vec<String>,
    /// The same, in all conditions, the nominal one too.
    #[arg(long, value_name = "PATH=VALUE[;...]")]
    pub base: Vec<String>,
    /// Rows of steps.csv for every so many steps only.
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = value_parser!(u32).range(1..))]
    pub every: u32,
    /// Share of the fleet, 1 to 1000, beside experiments [default: 100]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    pub priority: Option<u32>,
    /// Compute in this process, with workers of its own, as `run` does.
    #[arg(long)]
    pub local: bool,
    /// Number of these workers [default: the number of cores]
    #[arg(long, value_name = "N", requires = "local", value_parser = value_parser!(u16).range(1..=1024))]
    pub workers: Option<u16>,
    /// Directory of the results; made if there is none.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    #[command(flatten)]
    pub isa: IsaArgs,
}

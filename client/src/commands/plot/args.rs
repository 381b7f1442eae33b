//! The arguments of `swarmctl plot`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::ArgValueCompleter;

use crate::{complete, output_file::Overwrite};

/// Draw the fitness of runs over their generations.
///
/// One curve per run: the mean over the individuals of each generation, in a band
/// from the worst to the best of them. The same runs give the same file, byte by
/// byte.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct PlotArgs {
    /// Numbers of the coordinator's experiments, names of groups, or files written by
    /// `swarmctl history ID --output csv`; at most 14 runs.
    #[arg(required_unless_present = "steps", value_name = "ID|GROUP|FILE", add = ArgValueCompleter::new(complete::experiments_and_files))]
    pub runs: Vec<String>,
    /// Draw an evaluation instead, from the directory that `swarmctl evaluate` wrote.
    ///
    /// One curve per condition: the median over the trials, in a band from the first
    /// to the third quartile.
    #[arg(long, value_name = "DIR", conflicts_with = "runs")]
    pub steps: Option<PathBuf>,
    /// Name of the evaluation's measure to draw.
    #[arg(long, value_name = "NAME", requires = "steps")]
    pub metric: Option<String>,
    /// Name of a condition of the evaluation to draw. Give it several times to draw
    /// several, in this order [default: all]
    #[arg(long = "condition", value_name = "NAME", requires = "steps")]
    pub conditions: Vec<String>,
    /// File of the figure; its name ends in .svg or .png.
    #[arg(long, value_name = "FILE")]
    pub to: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl plot 3 4 --to fitness.svg
  swarmctl plot ga.csv snes.csv --to fitness.png
  swarmctl plot --steps results/borderline --metric accuracy --to accuracy.svg";

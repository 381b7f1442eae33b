//! `swarmctl plot`.

use std::path::PathBuf;

use clap::Args;

/// What to draw.
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// Numbers of experiments of the coordinator, or files that `swarmctl history
    /// ID --output csv` has written; at most 14.
    #[arg(required_unless_present = "steps", value_name = "ID|FILE")]
    pub runs: Vec<String>,
    /// Draw an evaluation instead: the directory that `swarmctl evaluate` has written.
    ///
    /// A curve per condition: the median over the trials, between the quartiles.
    #[arg(long, value_name = "DIR", conflicts_with = "runs")]
    pub steps: Option<PathBuf>,
    /// Which measure of the evaluation.
    #[arg(long, value_name = "NAME", requires = "steps")]
    pub metric: Option<String>,
    /// Which condition of the evaluation; several times for several, in this order.
    /// All of them if none is named.
    #[arg(long = "condition", value_name = "NAME", requires = "steps")]
    pub conditions: Vec<String>,
    /// The figure: .svg for documents, .png for everything else.
    #[arg(long, value_name = "FILE")]
    pub to: PathBuf,
}

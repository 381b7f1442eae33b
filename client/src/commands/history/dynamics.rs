//! The movement of evolution, as a table.

use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{Experiment, GenerationDynamics};

use crate::{
    connection::Connection,
    error::Error,
    progress::Progress,
    table::{Column, Table},
    text,
};

const CSV_KEYS: [&str; 10] = [
    "experiment",
    "generation",
    "mean_step",
    "mean_path",
    "deviation_min",
    "deviation_q1",
    "deviation_median",
    "deviation_q3",
    "deviation_max",
    "rank_correlation",
];

/// The movement of a generation. Step, way and deviations are null if the algorithm has no
/// distribution.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Dynamics")]
pub struct Record {
    /// Number of the experiment.
    experiment: u64,
    /// Number of the generation, from 0.
    generation: u64,
    /// Distance from the mean of the distribution to the next one, in genes.
    mean_step: Option<f64>,
    /// Length of the way of the mean up to this generation, in genes.
    mean_path: Option<f64>,
    /// Least standard deviation of a gene.
    deviation_min: Option<f64>,
    /// Lower quartile of the genes' standard deviations.
    deviation_q1: Option<f64>,
    /// Median of the genes' standard deviations.
    deviation_median: Option<f64>,
    /// Upper quartile of the genes' standard deviations.
    deviation_q3: Option<f64>,
    /// Greatest standard deviation of a gene.
    deviation_max: Option<f64>,
    /// Spearman's rank correlation of fitness between trials, the mean over pairs of trials, from
    /// -1 to 1; null for a single trial.
    rank_correlation: Option<f64>,
}

/// Prints the movement of experiments.
pub async fn print(
    experiments: &[Experiment],
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let mut records = Vec::new();
    for experiment in experiments {
        let mut path = 0.0;
        for of in connection.dynamics(experiment.id).await? {
            path += of.mean_step.unwrap_or_default();
            records.push(record(experiment.id, path, of));
        }
    }
    progress.print_table(&table(&records), &CSV_KEYS, &records, "no generation is complete yet")
}

fn record(experiment: u64, path: f64, of: GenerationDynamics) -> Record {
    let deviation = |nth: usize| of.deviations.get(nth).copied();
    Record {
        experiment,
        generation: of.generation,
        mean_step: of.mean_step,
        mean_path: of.mean_step.map(|_| path),
        deviation_min: deviation(0),
        deviation_q1: deviation(1),
        deviation_median: deviation(2),
        deviation_q3: deviation(3),
        deviation_max: deviation(4),
        rank_correlation: of.rank_correlation,
    }
}

fn table(records: &[Record]) -> Table {
    let mut table = Table::new([
        Column::number("experiment").wide(),
        Column::number("generation"),
        Column::number("step"),
        Column::number("path"),
        Column::number("sigma min"),
        Column::number("q1").wide(),
        Column::number("median"),
        Column::number("q3").wide(),
        Column::number("max"),
        Column::number("rank corr."),
    ]);
    let cell = |value: Option<f64>| value.map_or("-".to_owned(), |value| text::number(value, 4));
    for of in records {
        table.push([
            of.experiment.to_string(),
            of.generation.to_string(),
            cell(of.mean_step),
            cell(of.mean_path),
            cell(of.deviation_min),
            cell(of.deviation_q1),
            cell(of.deviation_median),
            cell(of.deviation_q3),
            cell(of.deviation_max),
            cell(of.rank_correlation),
        ]);
    }
    table
}

//! `swarmctl history`: every generation of an experiment.

use clap::Args;
use serde::Serialize;
use swarm_proto::v1::GenerationSummary;

use super::Remote;
use crate::{
    args::ExperimentId,
    clock,
    connection::{Connection, present},
    error::Error,
    json,
    progress::Progress,
    table::{Column, Table},
    text,
};

const CSV_KEYS: [&str; 12] = [
    "experiment",
    "generation",
    "best",
    "mean",
    "min",
    "standard_deviation",
    "episodes",
    "duration_ms",
    "completed_at_ms",
    "workers",
    "idle_share",
    "digest",
];

/// A completed generation.
#[derive(Debug, Serialize)]
struct Record<'a> {
    #[serde(flatten)]
    generation: json::GenerationLine<'a>,
    completed_at_ms: u64,
}

/// Print every completed generation of an experiment.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct HistoryArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

const HELP: &str = "\
Tables and CSV have one row per generation. Best, mean, min and standard
deviation are taken over the individuals' mean fitness. CSV and JSON have every
digit.

Examples:
  swarmctl history 3 | tail -1
  swarmctl history 3 --output csv > history.csv
  swarmctl history 3 --output json | jq '.[].best'";

impl Remote for HistoryArgs {
    const HAS_TABLE: bool = true;

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiment_id = self.experiment.id;
        let mut generations = Vec::new();
        for completed in connection.generations(experiment_id).await? {
            generations.push((present(completed.summary)?, completed.completed_at_ms));
        }
        let records: Vec<Record<'_>> = generations
            .iter()
            .map(|&(ref summary, completed_at_ms)| {
                let generation = json::GenerationLine::new(experiment_id, summary);
                Record { generation, completed_at_ms }
            })
            .collect();
        let empty = "no generation is complete yet";
        progress.print_table(&table(&generations), &CSV_KEYS, &records, empty)
    }
}

fn table(generations: &[(GenerationSummary, u64)]) -> Table {
    let mut table = Table::new([
        Column::number("generation"),
        Column::number("best"),
        Column::number("mean"),
        Column::number("min"),
        Column::number("std"),
        Column::number("seconds"),
        Column::number("episodes").wide(),
        Column::number("episodes/s").wide(),
        Column::number("workers").wide(),
        Column::number("idle").wide(),
        Column::new("completed").wide(),
        Column::text("digest"),
    ]);
    for (summary, completed_at_ms) in generations {
        table.push([
            summary.generation.to_string(),
            format!("{:.6}", summary.best),
            format!("{:.6}", summary.mean),
            format!("{:.6}", summary.min),
            format!("{:.6}", summary.standard_deviation),
            format!("{:.2}", summary.duration_ms as f64 / 1000.0),
            summary.episodes.to_string(),
            format!("{:.0}", text::episodes_per_s(summary)),
            summary.workers.to_string(),
            text::percent(summary.idle_share),
            clock::utc(*completed_at_ms),
            text::short(&summary.digest).to_owned(),
        ]);
    }
    table
}

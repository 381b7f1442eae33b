//! `swarmctl history`: every generation of an experiment.

use serde::Serialize;
use swarm_proto::v1::GenerationSummary;

use crate::{
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
    generation: json::Generation<'a>,
    completed_at_ms: u64,
}

/// Prints a table.
pub async fn history(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let mut generations = Vec::new();
    for completed in connection.generations(experiment_id).await? {
        generations.push((present(completed.summary)?, completed.completed_at_ms));
    }
    let records: Vec<Record<'_>> = generations
        .iter()
        .map(|&(ref summary, completed_at_ms)| {
            let generation = json::Generation::new(experiment_id, summary);
            Record { generation, completed_at_ms }
        })
        .collect();
    progress.print_table(&table(&generations), &CSV_KEYS, &records, "no generation is complete yet")
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

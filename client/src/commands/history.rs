//! `swarmctl history`: every generation of an experiment.

pub mod dynamics;

use clap::Args;
use swarm_proto::v1::GenerationSummary;

use crate::{
    args::Target,
    clock,
    connection::{Connection, present},
    error::Error,
    json,
    progress::Progress,
    remote::Remote,
    subject::Subject,
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

/// Print every completed generation of an experiment, or of all of a group.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct HistoryArgs {
    #[command(flatten)]
    target: Target,
    /// Print the movement of evolution instead: the step of the mean and its way so far, the
    /// genes' standard deviations, and the rank correlation of fitness between trials.
    #[arg(long)]
    dynamics: bool,
}

const HELP: &str = "\
Tables and CSV have one row per generation. Best, mean, min and standard
deviation are taken over the individuals' mean fitness. CSV and JSON have every
digit.

With --dynamics, the rank correlation (Spearman's, mean over pairs of trials)
shows how much of selection was luck: at 0, another trial ranks the individuals
in an unrelated order. Step, way and deviations describe a distribution; a GA
has none. The command recomputes all of them from the fitness log.

Examples:
  swarmctl history 3 | tail -1
  swarmctl history 3 --output csv > history.csv
  swarmctl history 3 --output json | jq '.[].best'
  swarmctl history 3 --dynamics --output csv > dynamics.csv";

impl Remote for HistoryArgs {
    fn has_table(&self) -> bool {
        true
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiments = connection.subject(&self.target.subject).await?;
        if self.dynamics {
            return dynamics::print(&experiments, connection, progress).await;
        }
        let mut rows = Vec::new();
        for experiment in experiments {
            for completed in connection.generations(experiment.id).await? {
                let summary = present(completed.summary)?;
                rows.push((experiment.id, summary, completed.completed_at_ms));
            }
        }
        let records: Vec<_> = rows
            .iter()
            .map(|&(experiment_id, ref summary, completed_at_ms)| {
                json::GenerationLine::new(experiment_id, summary).completed_at(completed_at_ms)
            })
            .collect();
        let empty = "no generation is complete yet";
        let is_group = matches!(self.target.subject, Subject::Group(_));
        progress.print_table(&table(&rows, is_group), &CSV_KEYS, &records, empty)
    }
}

fn table(rows: &[(u64, GenerationSummary, u64)], is_group: bool) -> Table {
    let experiment = Column::number("experiment");
    let mut table = Table::new([
        if is_group { experiment } else { experiment.wide() },
        Column::number("generation"),
        Column::number("best"),
        Column::number("mean"),
        Column::number("min").dropped(3),
        Column::number("std").dropped(4),
        Column::number("seconds").dropped(2),
        Column::number("episodes").wide(),
        Column::number("episodes/s").wide(),
        Column::number("workers").wide(),
        Column::number("idle").wide(),
        Column::new("completed").wide(),
        Column::text("digest").dropped(5),
    ]);
    for (experiment_id, summary, completed_at_ms) in rows {
        table.push([
            experiment_id.to_string(),
            summary.generation.to_string(),
            text::number(summary.best, 6),
            text::number(summary.mean, 6),
            text::number(summary.min, 6),
            text::number(summary.standard_deviation, 6),
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

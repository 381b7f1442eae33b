//! `swarmctl list`: all experiments.

use clap::Args;
use console::Style;
use swarm_proto::v1::Experiment;

use super::Remote;
use crate::{
    clock,
    connection::Connection,
    error::Error,
    json::{ExperimentDocument, state_name},
    progress::Progress,
    table::{Column, Table},
};

/// Columns of the CSV: keys of [`ExperimentDocument`].
const CSV_KEYS: [&str; 13] = [
    "id",
    "name",
    "state",
    "reason",
    "generations_done",
    "generations",
    "champion_fitness",
    "champion_selection_fitness",
    "seed",
    "algorithm",
    "priority",
    "population_size",
    "submitted_at_ms",
];

/// List all experiments.
///
/// `judged` is the mean fitness of the champion on trials that selected nothing, once the
/// run has ended; `selection` that on the held-out trials by which it was selected, which
/// is optimistic.
#[derive(Debug, Args)]
pub struct ListArgs {}

impl Remote for ListArgs {
    const HAS_TABLE: bool = true;

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiments = connection.experiments().await?;
        let documents: Vec<ExperimentDocument<'_>> = experiments.iter().map(Into::into).collect();
        progress.print_table(&table(&experiments), &CSV_KEYS, &documents, "no experiments yet")
    }
}

fn table(experiments: &[Experiment]) -> Table {
    let fitness =
        |fitness: Option<f64>| fitness.map_or("-".into(), |fitness| format!("{fitness:.3}"));
    let mut table = Table::new([
        Column::number("id"),
        Column::new("state").painted(state_style),
        Column::number("generations"),
        Column::number("selection"),
        Column::number("judged"),
        Column::number("seed"),
        Column::new("algorithm"),
        Column::number("priority").wide(),
        Column::number("population").wide(),
        Column::number("genes").wide(),
        Column::new("submitted").wide(),
        Column::text("name"),
        Column::text("reason").wide(),
    ]);
    for experiment in experiments {
        table.push([
            experiment.id.to_string(),
            state_name(experiment.state()).into(),
            format!("{}/{}", experiment.generations_done, experiment.generations),
            fitness(experiment.champion_selection_fitness),
            fitness(experiment.champion_fitness),
            experiment.seed.to_string(),
            experiment.algorithm.clone(),
            experiment.priority.to_string(),
            experiment.population_size.to_string(),
            experiment.genotype_len.to_string(),
            clock::utc(experiment.submitted_at_ms),
            experiment.name.clone(),
            experiment.reason.clone(),
        ]);
    }
    table
}

/// Colours the states that need attention.
fn state_style(state: &str) -> Style {
    match state {
        "running" => Style::new().green(),
        "paused" => Style::new().yellow(),
        "failed" => Style::new().red(),
        _ => Style::new(),
    }
}

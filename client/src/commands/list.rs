//! `swarmctl list`: all experiments.

mod filter;

use clap::Args;
use clap_complete::ArgValueCompleter;
use console::Style;
use model::wire::{has_ended, state_name};
use swarm_proto::v1::{Experiment, ListWorkersRequest};

use crate::{
    clock, complete,
    connection::Connection,
    error::Error,
    json::ExperimentDocument,
    progress::Progress,
    remote::Remote,
    table::{Column, Table},
    text::{self, origin_address},
};

use self::filter::Filter;

/// Columns of the CSV: keys of [`ExperimentDocument`].
const CSV_KEYS: [&str; 28] = [
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
    "eta_ms",
    "group",
    "variant",
    "labels",
    "archived",
    "forked_from.experiment",
    "forked_from.generation",
    "forked_from.changes",
    "latest.generation",
    "latest.best",
    "latest.mean",
    "latest.min",
    "latest.standard_deviation",
    "genotype_len",
    "config_digest",
];

/// List all experiments, or those of a group.
///
/// `judged` is the champion's mean fitness on trials that selected nothing, known once the run has
/// ended. `selection` is its mean on the held-out trials that selected it, which is optimistic.
/// `best` and `mean` describe the latest generation. `eta` is the remaining time if generations
/// stay as fast as the latest ones. A narrow terminal shows fewer columns; `--output wide` shows
/// all.
#[derive(Debug, Args)]
#[command(visible_alias = "ls", after_help = HELP)]
pub struct ListArgs {
    /// Name of a group of experiments [default: all experiments]
    #[arg(value_name = "GROUP", add = ArgValueCompleter::new(complete::groups))]
    group: Option<String>,
    #[command(flatten)]
    filter: Filter,
}

const HELP: &str = "\
Examples:
  swarmctl list --state running,paused
  swarmctl list --label user=ada --sort best";

impl Remote for ListArgs {
    fn has_table(&self) -> bool {
        true
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let mut experiments = connection.list(self.filter.wanted(self.group.clone())).await?;
        if let Some(group) = &self.group
            && experiments.is_empty()
        {
            // Fails if the name does not exist.
            connection.group(group).await?;
        }
        self.filter.sort(&mut experiments);
        let documents: Vec<ExperimentDocument<'_>> = experiments.iter().map(Into::into).collect();
        let table = table(&experiments, clock::unix_ms());
        let n_archived = match experiments.is_empty() && !progress.is_json() {
            true => connection.list(self.filter.with_archived(self.group.clone())).await?.len(),
            false => 0,
        };
        let none = match n_archived {
            0 => "no such experiments".to_owned(),
            n => format!("no such experiments but {n} archived: --all lists them"),
        };
        progress.print_table(&table, &CSV_KEYS, &documents, &none)?;
        let request = ListWorkersRequest {};
        let answer = connection.call_fleet(async |client| client.list_workers(request).await);
        let n_evaluations = answer.await.map_or(0, |answer| answer.evaluations.len());
        if let Some(remark) = text::evaluations(n_evaluations) {
            progress.remark(&connection.in_place(&remark));
        }
        if let Some(data_dir) = connection.idle_data_dir().await
            && let Some(experiment) =
                experiments.iter().find(|experiment| !has_ended(experiment.state()))
        {
            progress.remark(&text::deserted(experiment, data_dir));
        }
        Ok(())
    }
}

fn table(experiments: &[Experiment], now_ms: u64) -> Table {
    let fitness =
        |fitness: Option<f64>| fitness.map_or("-".into(), |fitness| text::number(fitness, 3));
    // Columns without any value are shown with `--output wide` only.
    let shown_if = |is_used: bool, column: Column| if is_used { column } else { column.wide() };
    let has_groups = experiments.iter().any(|experiment| !experiment.group.is_empty());
    let has_labels = experiments.iter().any(|experiment| !experiment.labels.is_empty());
    let has_variants = experiments.iter().any(|experiment| !experiment.variant.is_empty());
    let mut table = Table::new([
        Column::number("id"),
        Column::new("state").painted(state_style),
        Column::number("generations"),
        Column::number("eta").dropped(2),
        Column::number("selection").dropped(3),
        Column::number("judged").dropped(1),
        Column::number("seed").dropped(5),
        Column::new("algorithm").dropped(7),
        Column::number("age").dropped(6),
        Column::number("best").wide(),
        Column::number("mean").wide(),
        Column::number("priority").wide(),
        Column::number("population").wide(),
        Column::number("genes").wide(),
        Column::new("submitted").wide(),
        shown_if(has_groups, Column::new("group").dropped(8)),
        shown_if(has_variants, Column::name("variant").dropped(4)),
        shown_if(has_labels, Column::text("labels").dropped(9)),
        Column::new("archived").wide(),
        Column::new("forked from").wide(),
        Column::name("name"),
        Column::text("reason").wide(),
        Column::text("changes").wide(),
    ]);
    for experiment in experiments {
        table.push([
            experiment.id.to_string(),
            state_name(experiment.state()).into(),
            format!("{}/{}", experiment.generations_done, experiment.generations),
            text::eta_ms(experiment).map_or("-".into(), clock::duration_ms),
            fitness(experiment.champion_selection_fitness),
            fitness(experiment.champion_fitness),
            experiment.seed.to_string(),
            experiment.algorithm.clone(),
            clock::duration_ms(now_ms.saturating_sub(experiment.submitted_at_ms) / 1000 * 1000),
            fitness(experiment.latest.as_ref().map(|latest| latest.best)),
            fitness(experiment.latest.as_ref().map(|latest| latest.mean)),
            experiment.priority.to_string(),
            experiment.population_size.to_string(),
            experiment.genotype_len.to_string(),
            clock::utc(experiment.submitted_at_ms),
            experiment.group.clone(),
            experiment.variant.clone(),
            text::labels(experiment),
            if experiment.archived { "yes" } else { "-" }.into(),
            experiment.forked_from.as_ref().map_or("-".into(), origin_address),
            experiment.name.clone(),
            experiment.reason.clone(),
            experiment
                .forked_from
                .as_ref()
                .map_or_else(String::new, |origin| origin.changes.join("; ")),
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

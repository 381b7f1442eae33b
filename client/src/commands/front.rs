//! `swarmctl front`: compromises between fitness and other aims, as a table, for programs, or as a
//! scatter plot.

use std::{collections::BTreeMap, path::PathBuf};

use clap::Args;
use clap_complete::ArgValueCompleter;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{Aim, Elite, Experiment, GetFrontResponse};
use swarm_telemetry::number;

use super::elites::{address, experiment_at};
use crate::{
    address::NamedAddress,
    complete,
    connection::Connection,
    error::Error,
    figure::{Drawing as _, Format, Scatter},
    output_file::Overwrite,
    output_format::OutputFormat,
    progress::{Part, Progress},
    remote::Remote,
    table::{Column, Table, csv_at},
    text,
};

/// Print the elites of a front, which NSGA-II evolves, or draw them as points.
///
/// No elite is better than another one in fitness and all aims. The table has the front, best
/// fitness first. Once a run has ended, every elite is judged on trials that selected nothing: the
/// front has those that no other one dominates by judged values. Before, all values are optimistic.
/// CSV and JSON have all elites.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct FrontArgs {
    /// The experiment, by number or name; ID@G, the front after its generation G.
    #[arg(value_name = "ID[@G]", add = ArgValueCompleter::new(complete::experiments))]
    address: NamedAddress,
    /// The point up to which the hypervolume counts: fitness, and then each aim. The default, the
    /// worst value of each among the elites, differs from run to run; name a point to compare runs.
    #[arg(long, value_name = "FITNESS,AIM", value_delimiter = ',', allow_hyphen_values = true)]
    reference: Vec<f64>,
    /// Draw fitness and the first aim, in a file whose name ends in .svg or .png.
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl front 3
  swarmctl front 3 --reference 0,10
  swarmctl front 3@40 --output csv > elites.csv
  swarmctl front 3 --output json | jq .figures.hypervolume
  swarmctl front 3 --to front.png";

/// A front, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Document {
    /// Number of the experiment.
    experiment: u64,
    /// The generation after which these are the elites, from 0.
    generation: u64,
    /// The aims beside fitness.
    aims: Vec<AimDocument>,
    /// The figures of judged values, or before the judgement of the evidence; null if no elite has
    /// finite values.
    figures: Option<FiguresDocument>,
    /// In the order in which they came.
    elites: Vec<EliteDocument>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Aim")]
struct AimDocument {
    /// MEASURE_OF, the key of its values.
    name: String,
    /// Name of the measure.
    measure: String,
    /// Which value of a trial counts: `mean` or `end`.
    of: String,
    /// `maximise` or `minimise`.
    direction: String,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Figures")]
struct FiguresDocument {
    /// The volume that the elites dominate, up to the reference point.
    hypervolume: f64,
    /// The reference point: fitness, and then each aim.
    reference: Vec<f64>,
    /// Share of the elites that no other one dominates by judged values; null before the judgement.
    stay: Option<f64>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "MemberOfFront")]
struct EliteDocument {
    /// Its address: ID@G/I.
    address: String,
    /// Whether it is on the front: no other one dominates it by judged values, once the elites are
    /// judged.
    shown: bool,
    /// Number of trials of its life.
    trials: u64,
    /// Mean fitness over these trials, optimistic.
    fitness: f64,
    /// Mean aims over these trials, by their names, optimistic.
    aims: BTreeMap<String, f64>,
    /// Its judgement; null before the end of a run, or if a number is not finite.
    judged: Option<JudgedDocument>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "JudgedMember")]
struct JudgedDocument {
    /// Mean fitness over trials that selected nothing.
    fitness: f64,
    /// Mean aims over these trials, by their names.
    aims: BTreeMap<String, f64>,
}

/// A figure of a front, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Drawn {
    /// Path of the figure.
    figure: String,
    /// Number of elites on the front.
    elites: usize,
}

impl Remote for FrontArgs {
    fn has_table(&self) -> bool {
        true
    }

    fn check(&self) -> Result<(), Error> {
        match &self.to {
            Some(to) => Format::check(to, self.overwrite),
            None => Ok(()),
        }
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let (experiment, generation) = experiment_at(connection, &self.address, "front").await?;
        let found = connection.front(experiment.id, generation, self.reference).await?;
        if let Some(to) = &self.to {
            scatter(&experiment, &found).write(to, self.overwrite)?;
            let n = found.shown.len();
            let figure = to.to_string_lossy().into_owned();
            return match progress.is_json() {
                true => progress.print_document(&Drawn { figure, elites: n }),
                false => progress.print(&format!("{n} elites in {figure}")),
            };
        }
        match progress.format {
            OutputFormat::Json => progress.print_document(&document(&experiment, &found)),
            OutputFormat::Csv => {
                let names: Vec<String> = found.aims.iter().map(name).collect();
                progress.print(&csv_at(&paths(&names), &document(&experiment, &found).elites))
            }
            OutputFormat::Table | OutputFormat::Wide => {
                let table = table(&found);
                progress.print_parts(&[Part::Table(table), Part::text(summary(&found))])
            }
        }
    }
}

fn is_judged(found: &GetFrontResponse) -> bool {
    found.figures.as_ref().is_some_and(|figures| figures.stay.is_some())
}

/// "hypervolume 12.3 up to (0, 10), 85 % of 120 elites stay on the front".
fn summary(found: &GetFrontResponse) -> String {
    let (n, generation) = (found.elites.len(), found.generation);
    let Some(figures) = &found.figures else {
        return format!("after generation {generation}: no elite has finite values");
    };
    let volume = volume(found);
    match figures.stay {
        Some(stay) => format!(
            "after generation {generation}, judged: {volume}, {} of {n} elites stay on the front",
            text::percent(stay)
        ),
        None => format!(
            "after generation {generation}: {volume}, {n} elites, not judged yet, so their values \
             are optimistic"
        ),
    }
}

/// "hypervolume 12.3 up to (0, 10)".
fn volume(found: &GetFrontResponse) -> String {
    let Some(figures) = &found.figures else { return String::new() };
    let reference: Vec<String> = figures.reference.iter().map(|value| number(*value, 4)).collect();
    format!("hypervolume {} up to ({})", number(figures.hypervolume, 6), reference.join(", "))
}

/// "turning_mean".
fn name(aim: &Aim) -> String {
    format!("{}_{}", aim.measure, aim.of)
}

fn document(experiment: &Experiment, found: &GetFrontResponse) -> Document {
    let aims = &found.aims;
    let point = |values: &[f64]| aims.iter().map(name).zip(values.iter().copied()).collect();
    let elite = |(index, elite): (u32, &Elite)| EliteDocument {
        address: address(elite),
        shown: found.shown.contains(&index),
        trials: elite.trials,
        fitness: elite.fitness,
        aims: point(&elite.descriptors),
        judged: elite.judged.as_ref().map(|judged| JudgedDocument {
            fitness: judged.fitness,
            aims: point(&judged.descriptors),
        }),
    };
    let aim = |aim: &Aim| AimDocument {
        name: name(aim),
        measure: aim.measure.clone(),
        of: aim.of.clone(),
        direction: aim.direction.clone(),
    };
    Document {
        experiment: experiment.id,
        generation: found.generation,
        aims: aims.iter().map(aim).collect(),
        figures: found.figures.as_ref().map(|figures| FiguresDocument {
            hypervolume: figures.hypervolume,
            reference: figures.reference.clone(),
            stay: figures.stay,
        }),
        elites: (0..).zip(&found.elites).map(elite).collect(),
    }
}

/// The columns of CSV. `names`: of the aims.
fn paths(names: &[String]) -> Vec<Vec<&str>> {
    let own = ["address", "shown", "trials", "fitness"].map(|key| vec![key]);
    let aims = names.iter().map(|name| vec!["aims", name]);
    let judged = names.iter().map(|name| vec!["judged", "aims", name]);
    own.into_iter().chain(aims).chain([vec!["judged", "fitness"]]).chain(judged).collect()
}

/// The fitness and the aims of an elite that count now; `None` if its judgement has none.
fn counted<'a>(found: &GetFrontResponse, elite: &'a Elite) -> Option<(f64, &'a [f64])> {
    match &elite.judged {
        Some(judged) => Some((judged.fitness, &judged.descriptors)),
        None if is_judged(found) => None,
        None => Some((elite.fitness, &elite.descriptors)),
    }
}

/// The measures of aims; with `mean` or `end` if another aim has the same measure.
fn headings(aims: &[Aim]) -> Vec<String> {
    let is_twice = |aim: &Aim| aims.iter().filter(|other| other.measure == aim.measure).count() > 1;
    aims.iter().map(|aim| if is_twice(aim) { name(aim) } else { aim.measure.clone() }).collect()
}

/// The front, best fitness first.
fn table(found: &GetFrontResponse) -> Table {
    let fitness = if is_judged(found) { "judged" } else { "fitness" };
    let headings = headings(&found.aims);
    let columns = [Column::number(fitness)]
        .into_iter()
        .chain(headings.iter().map(|heading| Column::number(heading)))
        .chain([Column::number("trials").wide(), Column::new("elite")]);
    let mut table = Table::new(columns.collect::<Vec<_>>());
    let shown = found.shown.iter().filter_map(|&index| found.elites.get(index as usize));
    let mut shown: Vec<(&Elite, f64, &[f64])> = shown
        .filter_map(|elite| counted(found, elite).map(|(fitness, aims)| (elite, fitness, aims)))
        .collect();
    shown.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (elite, fitness, aims) in shown {
        let mut row = vec![number(fitness, 6)];
        row.extend(aims.iter().map(|value| number(*value, 4)));
        row.extend([elite.trials.to_string(), address(elite)]);
        table.push(row);
    }
    table
}

/// Fitness and the first aim of all elites; the front stands out.
fn scatter(experiment: &Experiment, found: &GetFrontResponse) -> Scatter {
    let aim = found.aims.first();
    let label = aim.map(|aim| format!("{} ({}), {}", aim.measure, aim.of, aim.direction));
    let point = |(index, elite): (u32, &Elite)| {
        let (fitness, aims) = counted(found, elite)?;
        Some(([*aims.first()?, fitness], found.shown.contains(&index)))
    };
    let state = match is_judged(found) {
        true => "judged on new trials".to_owned(),
        false => format!("after generation {}, optimistic", found.generation),
    };
    Scatter {
        title: format!("Front of {} ({})", experiment.name, experiment.algorithm),
        caption: format!("{state}; {}", volume(found)),
        labels: [label.unwrap_or_default(), "fitness".to_owned()],
        points: (0..).zip(&found.elites).filter_map(point).collect(),
    }
}

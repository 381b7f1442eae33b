//! `swarmctl repertoire`: elites of different behaviour, as a table, for programs, or as a heat
//! map.

use std::{collections::BTreeMap, path::PathBuf};

use clap::Args;
use clap_complete::ArgValueCompleter;
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{DescriptorAxis, Elite, Experiment, GetRepertoireResponse};
use swarm_telemetry::number;

use super::elites::{address, experiment_at};
use crate::{
    address::NamedAddress,
    complete,
    connection::Connection,
    error::{Code, Error},
    figure::{Drawing as _, Format, HeatMap, MapAxis},
    output_file::Overwrite,
    output_format::OutputFormat,
    progress::{Part, Progress},
    remote::Remote,
    table::{Column, Table, csv_at},
    text,
};

/// Print the elites of a repertoire, such as MAP-Elites evolves, or draw them as a map.
///
/// The table has the fittest elite of every cell. Once a run has ended, every elite is judged
/// on trials that selected nothing: it is then in the cell of its judged behaviour. Before, the
/// fitness is optimistic. CSV and JSON have all elites.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct RepertoireArgs {
    /// The experiment, by number or name; ID@G, the repertoire after its generation G.
    #[arg(value_name = "ID[@G]", add = ArgValueCompleter::new(complete::experiments))]
    address: NamedAddress,
    /// Draw the first two descriptors as a heat map, in a file whose name ends in .svg or .png.
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl repertoire 3
  swarmctl repertoire 3@40 --output csv > elites.csv
  swarmctl repertoire 3 --output json | jq .corrected
  swarmctl repertoire 3 --to map.png
  swarmctl replay '3@199/cell(3,17)'";

/// A repertoire, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Document {
    /// Number of the experiment.
    experiment: u64,
    /// The generation after which these are the elites, from 0.
    generation: u64,
    /// The axes of the grid.
    axes: Vec<AxisDocument>,
    /// The figures of the judged elites; null before the end of a run.
    corrected: Option<CorrectedDocument>,
    /// In the order in which they came.
    elites: Vec<EliteDocument>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Axis")]
struct AxisDocument {
    /// MEASURE_OF, the key of its values.
    name: String,
    /// Name of the measure.
    measure: String,
    /// Which value of a trial counts: `mean` or `end`.
    of: String,
    /// Beginning and end of the grid.
    range: [f64; 2],
    /// Number of cells.
    cells: u32,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Corrected")]
struct CorrectedDocument {
    /// The judged fitness of the shown elites, added up.
    qd_score: f64,
    /// Share of the cells that have an elite.
    coverage: f64,
    /// Share of the elites whose judged behaviour is in the cell of their evidence.
    stay: f64,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Elite")]
struct EliteDocument {
    /// Its address: ID@G/I.
    address: String,
    /// Whether it is the fittest of its cell by evidence: in the cell of its judged behaviour, once
    /// the elites are judged.
    shown: bool,
    /// Number of trials of its life.
    trials: u64,
    /// Mean fitness over these trials, optimistic.
    fitness: f64,
    /// Index of the cell of its evidence on every axis.
    cell: Vec<u32>,
    /// Mean descriptors over these trials, by the names of the axes.
    descriptors: BTreeMap<String, f64>,
    /// Its judgement; null before the end of a run, or if a number is not finite.
    judged: Option<JudgedDocument>,
}

#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Judged")]
struct JudgedDocument {
    /// Mean fitness over trials that selected nothing.
    fitness: f64,
    /// Index of the cell of the judged behaviour on every axis.
    cell: Vec<u32>,
    /// Mean descriptors over these trials, by the names of the axes.
    descriptors: BTreeMap<String, f64>,
}

/// A map of a repertoire, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Mapped {
    /// Path of the figure.
    figure: String,
    /// Number of cells that have an elite.
    cells: usize,
}

impl Remote for RepertoireArgs {
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
        let (experiment, generation) =
            experiment_at(connection, &self.address, "repertoire").await?;
        let found = connection.repertoire(experiment.id, generation).await?;
        if let Some(to) = &self.to {
            heat_map(&experiment, &found)?.write(to, self.overwrite)?;
            let n = found.shown.len();
            let figure = to.to_string_lossy().into_owned();
            return match progress.is_json() {
                true => progress.print_document(&Mapped { figure, cells: n }),
                false => progress.print(&format!("{n} cells in {figure}")),
            };
        }
        match progress.format {
            OutputFormat::Json => progress.print_document(&document(&experiment, &found)),
            OutputFormat::Csv => {
                let names: Vec<String> = found.axes.iter().map(name).collect();
                progress.print(&csv_at(&paths(&names), &document(&experiment, &found).elites))
            }
            OutputFormat::Table | OutputFormat::Wide => {
                let table = table(&found);
                progress.print_parts(&[Part::Table(table), Part::text(summary(&found))])
            }
        }
    }
}

/// "QD score 12.3, coverage 40 %, 85 % of 120 elites stay in their cell".
fn summary(found: &GetRepertoireResponse) -> String {
    let n = found.elites.len();
    match found.corrected {
        Some(of) => format!(
            "after generation {}, judged: QD score {}, coverage {}, {} of {n} elites stay in their \
             cell",
            found.generation,
            number(of.qd_score, 6),
            text::percent(of.coverage),
            text::percent(of.stay)
        ),
        None if n == 0 => {
            format!("after generation {}: no individual has finite values", found.generation)
        }
        None => format!(
            "after generation {}: {n} elites, not judged yet, so their fitness is optimistic",
            found.generation
        ),
    }
}

/// "order_mean".
fn name(axis: &DescriptorAxis) -> String {
    format!("{}_{}", axis.measure, axis.of)
}

fn document(experiment: &Experiment, found: &GetRepertoireResponse) -> Document {
    let axes = &found.axes;
    let point = |values: &[f64]| axes.iter().map(name).zip(values.iter().copied()).collect();
    let elite = |(index, elite): (u32, &Elite)| EliteDocument {
        address: address(elite),
        shown: found.shown.contains(&index),
        trials: elite.trials,
        fitness: elite.fitness,
        cell: elite.cell.clone(),
        descriptors: point(&elite.descriptors),
        judged: elite.judged.as_ref().map(|judged| JudgedDocument {
            fitness: judged.fitness,
            cell: judged.cell.clone(),
            descriptors: point(&judged.descriptors),
        }),
    };
    let axis = |axis: &DescriptorAxis| AxisDocument {
        name: name(axis),
        measure: axis.measure.clone(),
        of: axis.of.clone(),
        range: [axis.low, axis.high],
        cells: axis.cells,
    };
    Document {
        experiment: experiment.id,
        generation: found.generation,
        axes: axes.iter().map(axis).collect(),
        corrected: found.corrected.map(|of| CorrectedDocument {
            qd_score: of.qd_score,
            coverage: of.coverage,
            stay: of.stay,
        }),
        elites: (0..).zip(&found.elites).map(elite).collect(),
    }
}

/// The columns of CSV. `names`: of the axes.
fn paths(names: &[String]) -> Vec<Vec<&str>> {
    let own = ["address", "shown", "trials", "fitness", "cell"].map(|key| vec![key]);
    let descriptors = names.iter().map(|name| vec!["descriptors", name]);
    let judged = ["fitness", "cell"].map(|key| vec!["judged", key]);
    let of_judged = names.iter().map(|name| vec!["judged", "descriptors", name]);
    own.into_iter().chain(descriptors).chain(judged).chain(of_judged).collect()
}

/// The shown elites, each with the cell, the fitness and the descriptors that count now.
fn shown(found: &GetRepertoireResponse) -> impl Iterator<Item = (&Elite, &[u32], f64, &[f64])> {
    let elites = found.shown.iter().filter_map(|&index| found.elites.get(index as usize));
    elites.map(|elite| match elite.judged.as_ref().filter(|_| found.corrected.is_some()) {
        Some(judged) => (elite, &judged.cell[..], judged.fitness, &judged.descriptors[..]),
        None => (elite, &elite.cell[..], elite.fitness, &elite.descriptors[..]),
    })
}

fn table(found: &GetRepertoireResponse) -> Table {
    let fitness = if found.corrected.is_some() { "judged" } else { "fitness" };
    let columns = [Column::new("cell"), Column::number(fitness)].into_iter();
    let columns = columns
        .chain(found.axes.iter().map(|axis| Column::number(&axis.measure)))
        .chain([Column::number("trials").wide(), Column::new("elite")]);
    let mut table = Table::new(columns.collect::<Vec<_>>());
    for (elite, cell, fitness, descriptors) in shown(found) {
        let cell: Vec<String> = cell.iter().map(ToString::to_string).collect();
        let mut row = vec![cell.join(","), number(fitness, 6)];
        row.extend(descriptors.iter().map(|value| number(*value, 4)));
        row.extend([elite.trials.to_string(), address(elite)]);
        table.push(row);
    }
    table
}

/// The map of the first two descriptors; of a single descriptor, a row.
fn heat_map(experiment: &Experiment, found: &GetRepertoireResponse) -> Result<HeatMap, Error> {
    if found.axes.len() > 2 {
        return Err(Error::at(
            Code::BadArgument,
            "--to",
            format!(
                "a map shows two descriptors, and this repertoire has {}; `--output csv` has all",
                found.axes.len()
            ),
        ));
    }
    let axis = |nth: usize| {
        let of = found.axes.get(nth);
        MapAxis {
            label: of.map(|axis| format!("{} ({})", axis.measure, axis.of)).unwrap_or_default(),
            low: of.map_or(0.0, |axis| axis.low),
            high: of.map_or(1.0, |axis| axis.high),
            n_cells: of.map_or(1, |axis| axis.cells),
        }
    };
    let cell = |(_, cell, fitness, _): (&Elite, &[u32], f64, &[f64])| {
        ([cell[0], cell.get(1).copied().unwrap_or(0)], fitness)
    };
    Ok(HeatMap {
        title: format!("Repertoire of {} ({})", experiment.name, experiment.algorithm),
        caption: match found.corrected {
            Some(of) => format!(
                "judged on new trials; QD score {}, coverage {}",
                number(of.qd_score, 4),
                text::percent(of.coverage)
            ),
            None => format!("after generation {}, optimistic", found.generation),
        },
        value: "fitness".to_owned(),
        axes: [axis(0), axis(1)],
        cells: shown(found).map(cell).collect(),
    })
}

//! `swarmctl simulate`: single trials, the same as in evolution.

mod args;
mod champion;
pub mod genotype;
mod trace;

use std::{borrow::Cow, path::Path};

use experiment_file::Seed;
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::Serialize;
use sim_core::{EpisodeSummary, EvaluateError, MeasureName};

use crate::{
    connection::Connection,
    error::{Code, Error},
    experiment_file::{Compiled, ExperimentFile},
    place::Intent,
    progress::{Part, Progress},
    settings::Settings,
    table::{self, Column, Table},
    text, waiting,
};

pub use self::args::SimulateArgs;
use self::{genotype::Genotype, trace::Trace};

/// Simulates the trials one after the other. Asks a coordinator only for a genotype of one
/// of its experiments.
pub async fn simulate(
    settings: Settings,
    args: &SimulateArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    args.trace.as_deref().map(|path| args.overwrite.check(path)).transpose()?;
    let Subject { compiled, genotype, generation } = subject(settings, args, progress).await?;
    // Refuses an unfit genotype before touching a file.
    let refused = |error: EvaluateError| {
        Error::at(Code::BadGenotype, genotype.place(), format!("{genotype}: {error}"))
    };
    compiled.experiment.network_json(&genotype.genes).map_err(refused)?;
    let mut trace = match &args.trace {
        Some(path) => Some(Trace::create(
            path,
            &compiled.config,
            &compiled.experiment,
            &args.trace_columns,
            args.overwrite,
        )?),
        None => None,
    };
    let trials = waiting::busy(
        "computing the trials; --trials reduces their number, --steps their length",
        || {
            let mut trials = Vec::new();
            for trial in 0..compiled.config.algorithm.num_evaluations {
                let observe: &mut dyn FnMut(&_) = match &mut trace {
                    Some(trace) => &mut |record| trace.record(trial, record),
                    None => &mut |_| {},
                };
                let simulated =
                    compiled.experiment.simulate(&genotype.genes, generation, trial, observe);
                let summary = simulated
                    .map_err(|error| Error::Input(error.to_string()).about(genotype.place()))?;
                trials.push(Trial { trial, summary });
            }
            Ok::<_, Error>(trials)
        },
    )?;
    let n_rows = trace.map(Trace::finish).transpose()?;
    let report = SimulationReport {
        name: &compiled.config.name,
        genotype: genotype.to_string(),
        seed: Seed(compiled.config.seed),
        generation,
        steps: compiled.config.algorithm.evaluation_steps,
        mean: mean(&trials),
        trials,
        trace: args.trace.as_deref().map(Path::to_string_lossy),
        trace_rows: n_rows,
    };
    match progress.is_json() {
        true => progress.print_document(&report),
        false => progress.print_parts(&report.to_parts()),
    }
}

/// The genotype and the experiment to simulate.
struct Subject {
    compiled: Compiled,
    genotype: Genotype,
    /// The generation of the worlds.
    generation: u64,
}

async fn subject(
    settings: Settings,
    args: &SimulateArgs,
    progress: &mut Progress,
) -> Result<Subject, Error> {
    if let Some(address) = args.address() {
        if args.genotype.is_some() || args.experiment.is_some() {
            let message = format!(
                "no file `{address}` exists; if it is the address of a genotype, leave out \
                 --genotype and --experiment, which need an experiment file"
            );
            return Err(Error::at(Code::UnreadableFile, address, message));
        }
        let connection = Connection::open(settings, Intent::Read, progress).await?;
        let address = connection.resolve(&address).await?;
        let found = connection.genotype(address).await?;
        let name = format!("experiment {}", address.experiment);
        let compiled =
            args.compiled(&ExperimentFile::new(name.into(), found.config_json.clone()))?;
        let generation = args.generation.unwrap_or(found.individual.generation);
        return Ok(Subject { compiled, genotype: Genotype::found(address, found), generation });
    }
    let file = args.file()?;
    let compiled = args.compiled(&file)?;
    for warning in &compiled.warnings {
        progress.remark(&format!("warning: {}: {warning}", args.subject.display()));
    }
    let genotype = Genotype::choose(settings, args, &file, &compiled, progress).await?;
    Ok(Subject { compiled, genotype, generation: args.generation.unwrap_or_default() })
}

/// The simulated experiment, with fitness and measures per trial.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Simulation")]
pub struct SimulationReport<'a> {
    /// Name of the experiment.
    name: &'a str,
    /// The source of the genotype, for people.
    genotype: String,
    seed: Seed,
    /// The generation of the worlds, from 0.
    generation: u64,
    /// Number of steps of a trial.
    steps: u32,
    /// In their order.
    trials: Vec<Trial>,
    /// Means over the trials; for a measure, over the trials that have it.
    mean: EpisodeSummary,
    /// Path of the recorded steps, with --trace only.
    #[serde(skip_serializing_if = "Option::is_none")]
    trace: Option<Cow<'a, str>>,
    /// Number of rows of that file.
    #[serde(skip_serializing_if = "Option::is_none")]
    trace_rows: Option<u64>,
}

#[derive(Debug, Serialize, JsonSchema)]
struct Trial {
    /// Number of the trial, from 0.
    trial: u32,
    #[serde(flatten)]
    summary: EpisodeSummary,
}

impl SimulationReport<'_> {
    fn to_parts(&self) -> Vec<Part> {
        let Self { name, genotype, seed: Seed(seed), generation, steps, .. } = self;
        let heading = format!(
            "{name}: {genotype}, seed {seed}, generation {generation}, {steps} steps per trial"
        );
        let names: Vec<&str> = self.mean.measures.keys().map(|name| &**name).collect();
        let row = |name: &str, summary: &EpisodeSummary| -> Vec<String> {
            let metrics = names.iter().map(|name| summary.measures.get(*name).copied());
            let numbers = std::iter::once(Some(summary.fitness)).chain(metrics);
            let cells = numbers.map(|n| n.map_or("-".into(), |n| text::number(n, 6)));
            std::iter::once(name.to_owned()).chain(cells).collect()
        };
        let columns = ["trial", "fitness"].iter().map(|name| Column::number(name));
        let mut table =
            Table::new(columns.chain(table::measures(names.iter().copied())).collect::<Vec<_>>());
        for trial in &self.trials {
            table.push(row(&trial.trial.to_string(), &trial.summary));
        }
        table.push(row("mean", &self.mean));
        let mut parts = vec![Part::Text(heading), Part::Table(table)];
        if let (Some(trace), Some(n_rows)) = (&self.trace, self.trace_rows) {
            parts.push(Part::Text(format!("{n_rows} rows in {trace}")));
        }
        parts
    }
}

/// Means over the trials; for a measure, over the trials that have it.
fn mean(trials: &[Trial]) -> EpisodeSummary {
    let mut sums: IndexMap<&MeasureName, (f64, f64)> = IndexMap::new();
    for (name, value) in trials.iter().flat_map(|trial| &trial.summary.measures) {
        let (sum, n) = sums.entry(name).or_insert((0.0, 0.0));
        (*sum, *n) = (*sum + value, *n + 1.0);
    }
    let fitness = trials.iter().fold(0.0, |sum, trial| sum + trial.summary.fitness);
    EpisodeSummary {
        fitness: fitness / trials.len() as f64,
        measures: sums.into_iter().map(|(name, (sum, n))| (name.clone(), sum / n)).collect(),
    }
}

#[cfg(test)]
mod tests;

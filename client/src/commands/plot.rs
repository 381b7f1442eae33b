//! `swarmctl plot`: figures of fitness over generations, or of a measure over steps.

mod args;
mod steps;

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    connection::Connection,
    error::{Code, Error},
    figure::{CURVES_MAX, Curve, Drawing as _, Figure, Format, Point},
    place::Intent,
    progress::Progress,
    recorded::{Run, Source},
    settings::Settings,
};

pub use self::args::PlotArgs;

/// Reads the runs and draws them. Asks the coordinator only about runs without a file.
pub async fn plot(
    settings: Settings,
    args: &PlotArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    // Refuses a bad name of the figure before reading anything.
    Format::check(&args.to, args.overwrite)?;
    if let Some(dir) = &args.steps {
        return plot_steps(dir, args, progress);
    }
    let too_many = || Error::Input(format!("a figure holds at most {CURVES_MAX} runs"));
    if args.runs.len() > CURVES_MAX {
        return Err(too_many());
    }
    let sources: Vec<Source> = args.runs.iter().map(|run| Source::parse(run)).collect();
    let remote = sources.iter().any(|source| matches!(source, Source::Coordinator(_)));
    let connection = match remote {
        true => Some(Connection::open(settings, Intent::Read, progress).await?),
        false => None,
    };
    let mut runs = Vec::new();
    for source in &sources {
        match source {
            Source::File(path) => runs.push(Run::read(path)?),
            Source::Coordinator(subject) => {
                let connection = connection.as_ref().expect("connected if it is asked");
                let experiments = connection.subject(subject).await?;
                if runs.len() + experiments.len() > CURVES_MAX {
                    return Err(too_many());
                }
                for experiment in experiments {
                    runs.push(Run::fetch(connection, experiment).await?);
                }
            }
        }
    }
    if runs.len() > CURVES_MAX {
        return Err(too_many());
    }
    let names = names(&runs);
    let function = common_function(&runs)?;
    figure(&runs, &names, function).write(&args.to, args.overwrite)?;
    if progress.is_json() {
        return progress.print_document(&Plotted::new(&runs, &names, &args.to));
    }
    let n_generations: usize = runs.iter().map(|run| run.points.len()).sum();
    let runs = if let [run] = &names[..] { run.clone() } else { format!("{} runs", runs.len()) };
    progress.print(&format!("{runs}: {n_generations} generations in {}", args.to.display()))
}

/// Draws a measure of an evaluation.
fn plot_steps(dir: &Path, args: &PlotArgs, progress: &mut Progress) -> Result<(), Error> {
    let figure = steps::figure(dir, args.metric.as_deref(), &args.conditions)?;
    if figure.curves.len() > CURVES_MAX {
        let message = format!("a figure holds at most {CURVES_MAX} conditions");
        return Err(Error::at(Code::BadArgument, "--condition", message));
    }
    figure.write(&args.to, args.overwrite)?;
    let conditions: Vec<&str> = figure.curves.iter().map(|curve| curve.name.as_str()).collect();
    let to = args.to.display();
    match progress.is_json() {
        true => progress.print_document(&PlottedSteps { figure: to.to_string(), conditions }),
        false => progress.print(&format!("{}: {} in {to}", figure.y_label, conditions.join(", "))),
    }
}

/// A figure of fitness over generations, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Plotted {
    /// Path of the figure.
    figure: String,
    /// One for each curve.
    runs: Vec<PlottedRun>,
}

#[derive(Debug, Serialize, JsonSchema)]
struct PlottedRun {
    /// Name in the legend.
    name: String,
    /// Number of generations that are drawn.
    generations: usize,
}

/// A figure of a measure over steps, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PlottedSteps<'a> {
    /// Path of the figure.
    figure: String,
    /// The condition of each curve.
    conditions: Vec<&'a str>,
}

impl Plotted {
    fn new(runs: &[Run], names: &[String], to: &Path) -> Self {
        let runs = runs.iter().zip(names);
        let plotted = |(run, name): (&Run, &String)| PlottedRun {
            name: name.clone(),
            generations: run.points.len(),
        };
        Self { figure: to.to_string_lossy().into_owned(), runs: runs.map(plotted).collect() }
    }
}

/// Names for the legend; ambiguous names are followed by their source.
fn names(runs: &[Run]) -> Vec<String> {
    let is_ambiguous = |run: &Run| runs.iter().filter(|other| other.name == run.name).count() > 1;
    let name = |run: &Run| match is_ambiguous(run) {
        true => format!("{} ({})", run.name, run.source),
        false => run.name.clone(),
    };
    runs.iter().map(name).collect()
}

/// The fitness function of all runs whose function is known; two functions cannot share
/// an axis.
fn common_function(runs: &[Run]) -> Result<Option<&str>, Error> {
    let mut known = runs.iter().filter_map(|run| Some((run, run.function.as_deref()?)));
    let Some((first, function)) = known.next() else { return Ok(None) };
    match known.find(|(_, other)| *other != function) {
        None => Ok(Some(function)),
        Some((run, other)) => {
            let message = format!(
                "{} has the fitness function {function}, {} has {other}: their values cannot share \
                 an axis; draw a figure of each",
                first.source, run.source
            );
            Err(Error::Input(message).about(&run.source))
        }
    }
}

/// The mean over the individuals, between the worst and the best of them.
fn figure(runs: &[Run], names: &[String], function: Option<&str>) -> Figure {
    let curve = |(run, name): (&Run, &String)| Curve {
        name: name.clone(),
        points: run.points.iter().map(Point::from).collect(),
    };
    Figure {
        title: match names {
            [one] => format!("Fitness of {one}"),
            several => format!("Fitness of {} runs", several.len()),
        },
        caption: "line: mean of the individuals; band: worst to best individual".into(),
        x_label: "generation".into(),
        y_label: function.map_or("fitness".into(), |function| format!("fitness ({function})")),
        curves: runs.iter().zip(names).map(curve).collect(),
    }
}

#[cfg(test)]
mod tests;

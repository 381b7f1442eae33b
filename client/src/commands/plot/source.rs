//! Reads runs to plot: from a coordinator, or from files that `history` wrote.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::{
    connection::{Connection, present},
    error::Error,
    figure::Point,
};

/// A run that the command line names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A number: an experiment of the coordinator.
    Experiment(u64),
    /// Anything else: a CSV file.
    File(PathBuf),
}

impl Source {
    /// A file whose name is a number is reached as `./NUMBER`.
    pub fn parse(text: &str) -> Self {
        text.parse().map_or_else(|_| Self::File(text.into()), Self::Experiment)
    }
}

/// The generations of a run that have a fitness.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub name: String,
    /// "experiment 3", or the path of the file.
    pub source: String,
    pub points: Vec<GenerationFitness>,
}

/// The fitness of a generation; a row of the file.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct GenerationFitness {
    generation: u64,
    // Empty in a file if it is not finite.
    best: Option<f64>,
    mean: Option<f64>,
    min: Option<f64>,
}

impl GenerationFitness {
    /// Whether there is something to draw.
    fn is_finite(&self) -> bool {
        [self.best, self.mean, self.min].iter().all(|value| value.is_some_and(f64::is_finite))
    }
}

impl From<&GenerationFitness> for Point {
    fn from(generation: &GenerationFitness) -> Self {
        let value = |value: Option<f64>| value.expect("only finite ones are kept");
        Self {
            x: generation.generation as f64,
            low: value(generation.min),
            middle: value(generation.mean),
            high: value(generation.best),
        }
    }
}

impl Run {
    /// The history of an experiment of the coordinator.
    pub async fn fetch(connection: &Connection, experiment_id: u64) -> Result<Self, Error> {
        let experiment = connection.experiment(experiment_id).await?;
        let mut generations = Vec::new();
        for completed in connection.generations(experiment_id).await? {
            let summary = present(completed.summary)?;
            generations.push(GenerationFitness {
                generation: summary.generation,
                best: Some(summary.best),
                mean: Some(summary.mean),
                min: Some(summary.min),
            });
        }
        let source = format!("experiment {experiment_id}");
        match Self::new(experiment.name, source.clone(), generations) {
            run if run.points.is_empty() => {
                Err(Error::NotFound(format!("{source} has no complete generation yet")))
            }
            run => Ok(run),
        }
    }

    /// A history in a file.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let problem = |problem: String| Error::Input(format!("{}: {problem}", path.display()));
        let mut reader = csv::Reader::from_path(path).map_err(|error| problem(plain(&error)))?;
        let generations: Vec<GenerationFitness> =
            reader.deserialize().collect::<Result<_, _>>().map_err(|error| {
                problem(format!(
                    "{}; expected what `swarmctl history ID --output csv` writes",
                    plain(&error)
                ))
            })?;
        if !generations.is_sorted_by_key(|generation| generation.generation) {
            return Err(problem("the generations are not those of one run, in order".into()));
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let run = Self::new(name, path.display().to_string(), generations);
        if run.points.is_empty() {
            return Err(problem("there is no generation with a fitness in it".into()));
        }
        Ok(run)
    }

    fn new(name: String, source: String, mut points: Vec<GenerationFitness>) -> Self {
        points.retain(GenerationFitness::is_finite);
        Self { name, source, points }
    }
}

/// The error of a CSV file, in one line.
pub fn plain(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::Io(error) => error.to_string(),
        csv::ErrorKind::Deserialize { pos, err } => {
            let line =
                pos.as_ref().map_or_else(String::new, |pos| format!("line {}: ", pos.line()));
            format!("{line}{err}")
        }
        _ => error.to_string(),
    }
}

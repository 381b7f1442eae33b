//! Recorded runs: of a coordinator, or in files that `history` wrote.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Deserializer};
use swarm_proto::v1::{Experiment, GenerationSummary};

use crate::{
    connection::{Connection, present},
    error::Error,
    figure::Point,
    file_kind::{self, Kind},
    input::{TABLE_BYTES, read_text},
    subject::Subject,
};

/// A run that the command line names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    /// A number or a name: experiments of the coordinator.
    Coordinator(Subject),
    /// Anything else: a CSV file.
    File(PathBuf),
}

impl Source {
    /// For a file without an extension, whose name could be that of a group, write `./NAME`.
    pub fn parse(text: &str) -> Self {
        text.parse().map_or_else(|_| Self::File(text.into()), Self::Coordinator)
    }
}

/// The generations of a run that have a fitness.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub name: String,
    /// The fitness function, if it is known.
    pub function: Option<String>,
    /// "experiment 3", or the path of the file.
    pub source: String,
    pub points: Vec<GenerationFitness>,
}

/// The fitness of a generation, which is also a row of the file.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct GenerationFitness {
    pub generation: u64,
    #[serde(deserialize_with = "number")]
    pub best: f64,
    #[serde(deserialize_with = "number")]
    pub mean: f64,
    #[serde(deserialize_with = "number")]
    pub min: f64,
    /// Number of episodes, if it is recorded.
    pub episodes: Option<u64>,
}

/// In files, the cell of a value that is not finite is empty.
fn number<'a, D: Deserializer<'a>>(value: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(value)?.unwrap_or(f64::NAN))
}

impl GenerationFitness {
    fn is_finite(&self) -> bool {
        [self.best, self.mean, self.min].iter().all(|value| value.is_finite())
    }
}

impl From<&GenerationFitness> for Point {
    fn from(generation: &GenerationFitness) -> Self {
        Self {
            x: generation.generation as f64,
            low: generation.min,
            middle: generation.mean,
            high: generation.best,
        }
    }
}

impl Run {
    /// The history of an experiment of the coordinator.
    pub async fn fetch(connection: &Connection, experiment: Experiment) -> Result<Self, Error> {
        let experiment_id = experiment.id;
        let mut generations = Vec::new();
        for completed in connection.generations(experiment_id).await? {
            let summary = present(completed.summary)?;
            let GenerationSummary { generation, best, mean, min, episodes, .. } = summary;
            let episodes = Some(episodes);
            generations.push(GenerationFitness { generation, best, mean, min, episodes });
        }
        let source = format!("experiment {experiment_id}");
        let (_, config_json) = connection.stored(experiment_id).await?;
        let function = fitness_function(&config_json);
        match (Self { function, ..Self::new(experiment.name, source.clone(), generations) }) {
            run if run.points.is_empty() => {
                let message = format!("{source} has no complete generation yet");
                Err(Error::WrongState(message).about(experiment_id))
            }
            run => Ok(run),
        }
    }

    /// A history in a file.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let problem = |problem: String| Error::of_file(path, problem);
        file_kind::expect(path, &[Kind::History], "the history of a run").map_err(problem)?;
        let text = read_text(path, TABLE_BYTES).map_err(|error| problem(error.to_string()))?;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let generations: Vec<GenerationFitness> =
            reader.deserialize().collect::<Result<_, _>>().map_err(|error| {
                problem(format!(
                    "{}; expected the output of `swarmctl history ID --output csv`",
                    plain(&error)
                ))
            })?;
        if !generations.is_sorted_by(|a, b| a.generation < b.generation) {
            return Err(problem("the generations must be those of one run, in order".into()));
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let run = Self::new(name, path.display().to_string(), generations);
        if run.points.is_empty() {
            return Err(problem("it has no generation with a fitness".into()));
        }
        Ok(run)
    }

    fn new(name: String, source: String, mut points: Vec<GenerationFitness>) -> Self {
        points.retain(GenerationFitness::is_finite);
        Self { name, function: None, source, points }
    }
}

/// The fitness function of an experiment file in canonical form.
fn fitness_function(config_json: &str) -> Option<String> {
    let file: serde_json::Value = serde_json::from_str(config_json).ok()?;
    Some(file["algorithm"]["fitness_function"].as_str()?.to_owned())
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

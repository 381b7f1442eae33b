//! Samples: runs of the same experiment that differ in their seed.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use experiment_file::Seed;
use serde::Deserialize;
use swarm_proto::v1::{Experiment, ExperimentState};

use crate::{
    connection::Connection,
    error::Error,
    file_kind::{self, Kind},
    input::{GENOTYPE_BYTES, read_text},
    progress::Progress,
    recorded::{GenerationFitness, Run},
    subject::Subject,
    text,
};

/// The error of a file whose run is unknown.
const UNNAMED: &str = "expected a file NAME-SEED.csv or NAME-SEED.json, or a champion file that \
                       names its experiment";

/// Runs that differ in their seed only.
#[derive(Debug)]
pub struct Sample {
    pub name: String,
    /// The runs by their seeds.
    pub runs: BTreeMap<u64, RecordedRun>,
}

/// The known facts of a run.
#[derive(Debug, Default)]
pub struct RecordedRun {
    /// The generations of the run, if known.
    pub history: Option<Vec<GenerationFitness>>,
    /// Fitness of the champion on trials that selected nothing, if known.
    pub judged: Option<f64>,
    /// The files or experiments from which the run was read.
    sources: Vec<String>,
}

impl Sample {
    /// The known histories.
    pub fn histories(&self) -> impl Iterator<Item = &[GenerationFitness]> {
        self.runs.values().filter_map(|run| run.history.as_deref())
    }
}

/// Samples while they are read, in the order of the command line.
#[derive(Debug, Default)]
pub struct Samples {
    samples: Vec<Sample>,
    problems: Vec<String>,
}

/// The compared part of a champion file.
#[derive(Debug, Deserialize)]
struct ChampionFile {
    #[serde(default)]
    name: String,
    seed: Seed,
    judged: Option<JudgedFile>,
}

#[derive(Debug, Deserialize)]
struct JudgedFile {
    mean: f64,
}

impl Samples {
    /// Reads files; the error lists all their problems.
    pub fn read(&mut self, paths: &[PathBuf]) -> Result<(), Error> {
        for path in paths {
            if let Err(problem) = self.read_file(path) {
                self.problems.push(format!("{}: {problem}", path.display()));
            }
        }
        self.check()
    }

    fn read_file(&mut self, path: &Path) -> Result<(), String> {
        let kinds = [Kind::History, Kind::Champion];
        file_kind::expect(path, &kinds, "the history of a run or a champion file")?;
        let of_file = name_and_seed(path);
        let source = path.display().to_string();
        if path.extension().is_some_and(|ending| ending == "json") {
            let text = read_text(path, GENOTYPE_BYTES).map_err(|error| error.to_string())?;
            let champion: ChampionFile = serde_json::from_str(&text)
                .map_err(|error| format!("{error}; expected the output of `swarmctl champion`"))?;
            let Seed(seed) = champion.seed;
            let name = match of_file {
                Some((_, other)) if other != seed => return Err(format!("its seed is {seed}")),
                Some((name, _)) => name,
                None if champion.name.is_empty() => return Err(UNNAMED.into()),
                None => champion.name,
            };
            let run = self.run(&name, seed);
            run.sources.push(source);
            if run.judged.is_some() {
                return Err(twice(run));
            }
            run.judged = champion.judged.map(|judged| judged.mean);
        } else {
            let (name, seed) = of_file.ok_or(UNNAMED)?;
            let history = Run::read(path).map_err(|error| error.to_string())?;
            let run = self.run(&name, seed);
            run.sources.push(source);
            if run.history.is_some() {
                return Err(twice(run));
            }
            run.history = Some(history.points);
        }
        Ok(())
    }

    /// Adds the experiments of a coordinator that have completed.
    pub async fn fetch(
        &mut self,
        connection: &Connection,
        subject: &Subject,
        progress: &mut Progress,
    ) -> Result<(), Error> {
        let experiments = connection.subject(subject).await?;
        let n_all = experiments.len() as u64;
        let names = names(&experiments);
        for (n_done, (experiment, name)) in experiments.into_iter().zip(names).enumerate() {
            progress.step(n_done as u64, n_all, "histories are read");
            if experiment.state() != ExperimentState::Completed {
                let line = text::state_line(&experiment);
                progress.remark(&format!("left out: {line}"));
                continue;
            }
            let history = Run::fetch(connection, experiment.clone()).await?.points;
            let run = self.run(&name, experiment.seed);
            let source = format!("experiment {}", experiment.id);
            if run.sources.contains(&source) {
                self.problems.push(format!("{source} is named twice"));
                continue;
            }
            run.sources.push(source);
            if run.history.is_some() {
                let problem = format!(
                    "{name}, seed {}: {}; name the runs to compare by their numbers, or delete one of \
                     them",
                    experiment.seed,
                    twice(run)
                );
                self.problems.push(problem);
                continue;
            }
            run.history = Some(history);
            run.judged = experiment.champion_fitness;
        }
        progress.clear();
        self.check()
    }

    /// The samples; fails if there is none.
    pub fn finish(self) -> Result<Vec<Sample>, Error> {
        if self.samples.is_empty() {
            return Err(Error::WrongState("no run has completed yet".into()));
        }
        let mut runs = self.samples.iter().flat_map(|sample| sample.runs.values());
        if runs.all(|run| run.judged.is_none() && run.history.is_none()) {
            let why = "no champion has been judged, and no run has a history; name files of \
                       `swarmctl history ID --output csv`, too";
            return Err(Error::Input(why.into()));
        }
        Ok(self.samples)
    }

    fn check(&mut self) -> Result<(), Error> {
        match self.problems.is_empty() {
            true => Ok(()),
            false => Err(Error::Input(self.problems.join("\n"))),
        }
    }

    fn run(&mut self, name: &str, seed: u64) -> &mut RecordedRun {
        let place = self.samples.iter().position(|sample| sample.name == name);
        let place = place.unwrap_or_else(|| {
            self.samples.push(Sample { name: name.to_owned(), runs: BTreeMap::new() });
            self.samples.len() - 1
        });
        self.samples[place].runs.entry(seed).or_default()
    }
}

/// The name and seed of a run, from the name of its file `NAME-SEED.ENDING`.
fn name_and_seed(path: &Path) -> Option<(String, u64)> {
    let stem = path.file_stem()?.to_string_lossy();
    let (name, seed) = stem.rsplit_once('-')?;
    Some((name.to_owned(), seed.parse().ok()?))
}

fn twice(run: &RecordedRun) -> String {
    format!("the run is given twice: {}", run.sources.join(", "))
}

/// The names of the samples of experiments: with the number of generations where a sample would
/// have a seed twice.
fn names(experiments: &[Experiment]) -> Vec<String> {
    let names: Vec<String> = experiments.iter().map(name).collect();
    let mut seen = BTreeSet::new();
    let runs = experiments.iter().zip(&names);
    let twice: BTreeSet<&String> = runs
        .filter(|(experiment, name)| !seen.insert((*name, experiment.seed)))
        .map(|(_, name)| name)
        .collect();
    let named = |(experiment, name): (&Experiment, &String)| match twice.contains(name) {
        true => {
            format!("{name}, {}", text::counted(experiment.generations, "generation"))
        }
        false => name.clone(),
    };
    experiments.iter().zip(&names).map(named).collect()
}

/// Runs of a group form a sample if they are of the same variant, other runs if they have
/// the same name.
fn name(experiment: &Experiment) -> String {
    match (&*experiment.group, &*experiment.variant) {
        ("", _) => experiment.name.clone(),
        (group, "") => group.to_owned(),
        (group, variant) => format!("{group} {variant}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_one_seed_and_several_lengths_are_several_samples() {
        let run = |group: &str, seed, generations| Experiment {
            name: "alone".into(),
            group: group.into(),
            seed,
            generations,
            ..Experiment::default()
        };
        let runs = [run("a", 0, 2), run("a", 1, 2), run("a", 0, 1), run("b", 0, 2), run("", 0, 2)];
        let expected = ["a, 2 generations", "a, 2 generations", "a, 1 generation", "b", "alone"];
        assert_eq!(names(&runs), expected);
    }
}

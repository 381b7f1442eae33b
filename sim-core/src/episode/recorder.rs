//! Recorders, which keep data of the steps of episodes.

use indexmap::IndexMap;

use super::GroupController;
use crate::record::{EpisodeSummary, MeasureName, Measures, StepRecord};
use crate::simulation::{EvaluateError, Simulation};
use crate::trial::Trial;

/// Sees every step of a number of episodes, numbered from 0.
pub(crate) trait Recorder {
    /// Called after environment step `step` of an episode, before its lights move. `fitness`: the
    /// fitness of the step; `None` if the step does not count.
    fn step(
        &mut self,
        episode: usize,
        step: u32,
        trial: &mut Trial<'_>,
        controllers: &[GroupController<'_>],
        fitness: Option<f64>,
    ) -> Result<(), EvaluateError>;

    /// Called after the last step of an episode. Episodes end in order.
    fn end(&mut self, episode: usize, trial: &Trial<'_>);
}

/// Keeps only the fitness of each episode.
#[derive(Debug, Default)]
pub(crate) struct FitnessOnly {
    /// Fitness per episode.
    pub fitness: Vec<f64>,
}

impl Recorder for FitnessOnly {
    fn step(
        &mut self,
        _: usize,
        _: u32,
        _: &mut Trial<'_>,
        _: &[GroupController<'_>],
        _: Option<f64>,
    ) -> Result<(), EvaluateError> {
        Ok(())
    }

    fn end(&mut self, _: usize, trial: &Trial<'_>) {
        self.fitness.push(trial.fitness());
    }
}

/// Keeps the fitness of each episode and, step by step, all measures; NaN where a measure has no
/// value.
#[derive(Debug)]
pub(crate) struct AllMeasures<'a> {
    names: &'a [MeasureName],
    /// Measures of the latest step.
    measures: Measures,
    /// Numbers per episode.
    n_values: usize,
    /// `[episode][value]`, the fitness first.
    pub values: Vec<f64>,
}

impl<'a> AllMeasures<'a> {
    /// A recorder for this many episodes.
    pub fn new(simulation: &'a Simulation, n_episodes: usize) -> Self {
        let n_values = simulation.values_per_trial();
        let values = vec![f64::NAN; n_episodes * n_values];
        Self { names: simulation.measure_names(), measures: Measures::new(), n_values, values }
    }
}

impl Recorder for AllMeasures<'_> {
    fn step(
        &mut self,
        episode: usize,
        step: u32,
        trial: &mut Trial<'_>,
        _: &[GroupController<'_>],
        _: Option<f64>,
    ) -> Result<(), EvaluateError> {
        trial.measure(step, &mut self.measures)?;
        let start = episode * self.n_values + 1 + step as usize * self.names.len();
        for (value, name) in self.values[start..].iter_mut().zip(self.names) {
            *value = self.measures.get(name).copied().unwrap_or(f64::NAN);
        }
        Ok(())
    }

    fn end(&mut self, episode: usize, trial: &Trial<'_>) {
        self.values[episode * self.n_values] = trial.fitness();
    }
}

/// Shows every step of one episode to a function.
pub(crate) struct Viewer<'a> {
    observe: &'a mut dyn FnMut(&StepRecord),
    /// The latest step. Every step refills this record, because its lists keep their lengths.
    record: StepRecord,
    /// The sum of each measure, and the number of its steps.
    sums: IndexMap<MeasureName, (f64, u32)>,
    fitness: f64,
}

impl<'a> Viewer<'a> {
    /// A viewer before the first step.
    pub fn new(observe: &'a mut dyn FnMut(&StepRecord)) -> Self {
        Self { observe, record: StepRecord::default(), sums: IndexMap::new(), fitness: 0.0 }
    }

    /// The summary of the whole episode.
    pub fn summary(self) -> EpisodeSummary {
        let means = self.sums.into_iter().map(|(name, (sum, n))| (name, sum / f64::from(n)));
        EpisodeSummary { fitness: self.fitness, measures: means.collect() }
    }
}

impl Recorder for Viewer<'_> {
    fn step(
        &mut self,
        _: usize,
        step: u32,
        trial: &mut Trial<'_>,
        controllers: &[GroupController<'_>],
        fitness: Option<f64>,
    ) -> Result<(), EvaluateError> {
        trial.record(step, fitness, &mut self.record)?;
        for controller in controllers {
            controller.record(&mut self.record);
        }
        for (name, value) in &self.record.measures {
            let (sum, n) = self.sums.entry(name.clone()).or_default();
            *sum += value;
            *n += 1;
        }
        (self.observe)(&self.record);
        Ok(())
    }

    fn end(&mut self, _: usize, trial: &Trial<'_>) {
        self.fitness = trial.fitness();
    }
}

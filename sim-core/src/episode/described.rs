//! The recorder of descriptors.

use experiment_file::Summarises;

use super::{GroupController, Recorder};
use crate::record::Measures;
use crate::simulation::{EvaluateError, Simulation};
use crate::trial::Trial;

/// Keeps the fitness and the descriptors of each episode.
#[derive(Debug)]
pub(crate) struct Described<'a> {
    simulation: &'a Simulation,
    /// Whether a descriptor needs the measures of every step.
    needs_all_steps: bool,
    /// Measures of the latest step.
    measures: Measures,
    /// The sum over the steps of an episode, and the number of steps; `[episode][descriptor]`.
    sums: Vec<(f64, u32)>,
    /// The fitness and the descriptors of each episode.
    pub values: Vec<f64>,
}

impl<'a> Described<'a> {
    /// A recorder for this many episodes.
    pub fn new(simulation: &'a Simulation, n_episodes: usize) -> Self {
        let descriptors = &simulation.descriptors;
        Self {
            simulation,
            needs_all_steps: descriptors.iter().any(|d| d.summarises == Summarises::Mean),
            measures: Measures::new(),
            sums: vec![(0.0, 0); n_episodes * descriptors.len()],
            values: Vec::with_capacity(n_episodes * (1 + descriptors.len())),
        }
    }
}

impl Recorder for Described<'_> {
    fn step(
        &mut self,
        episode: usize,
        step: u32,
        trial: &mut Trial<'_>,
        _: &[GroupController<'_>],
        _: Option<f64>,
    ) -> Result<(), EvaluateError> {
        let is_last = step + 1 == self.simulation.n_steps;
        if !is_last && !self.needs_all_steps {
            return Ok(());
        }
        trial.measure(step, &mut self.measures)?;
        let descriptors = &self.simulation.descriptors;
        let sums = &mut self.sums[episode * descriptors.len()..];
        for ((sum, n), descriptor) in sums.iter_mut().zip(descriptors) {
            let counts = is_last || descriptor.summarises == Summarises::Mean;
            if let Some(value) = self.measures.get(&descriptor.measure).filter(|_| counts) {
                *sum += value;
                *n += 1;
            }
        }
        Ok(())
    }

    fn end(&mut self, episode: usize, trial: &Trial<'_>) {
        self.values.push(trial.fitness());
        let n = self.simulation.descriptors.len();
        let sums = &self.sums[episode * n..][..n];
        self.values.extend(sums.iter().map(|&(sum, n)| mean(sum, n)));
    }
}

/// The mean; a NaN has the same bits on every processor.
fn mean(sum: f64, n: u32) -> f64 {
    let mean = sum / f64::from(n);
    if mean.is_nan() { f64::NAN } else { mean }
}

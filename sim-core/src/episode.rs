//! Episodes: all trials of one genotype, step by step and side by side, so that
//! their networks share one pass over the weights.

use std::ops::Range;

use indexmap::IndexMap;

use crate::controllers::{BraitenbergLightFollower, Controller, NeuralController};
use crate::lanes::Lanes;
use crate::network::Phenotype;
use crate::record::{EpisodeSummary, StepRecord};
use crate::simulation::{EvaluateError, Simulation};
use crate::trial::Trial;
use experiment_file::RobotController;
use numeric::random::TrialSet;

/// Lanes that are simulated side by side: enough to share the weights, few enough
/// to stay in the cache.
const MAX_LANES: usize = 256;

/// Simulates one episode per trial and returns their fitness, in order; none if
/// `keep_going`, asked before every step, has said no.
pub(crate) fn run(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trials: Range<u32>,
    keep_going: &dyn Fn() -> bool,
) -> Result<Option<Vec<f64>>, EvaluateError> {
    let mut fitness = Vec::with_capacity(trials.len());
    for trials in side_by_side(simulation, trials) {
        let mut episodes = Episodes::new(simulation, phenotype, trial_set, trials)?;
        for step in 0..simulation.n_steps {
            if !keep_going() {
                return Ok(None);
            }
            episodes.step(step, |_, _, _| {})?;
        }
        fitness.extend(episodes.trials.iter().map(Trial::fitness));
    }
    Ok(Some(fitness))
}

/// As [`run`], and measures every step: per trial its fitness, and then step by step
/// all measures, NaN where there is none.
pub(crate) fn measure(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trials: Range<u32>,
    keep_going: &dyn Fn() -> bool,
) -> Result<Option<Vec<f64>>, EvaluateError> {
    let names = simulation.metric_names();
    let n_values = simulation.values_per_trial();
    let mut values = Vec::with_capacity(trials.len() * n_values);
    for trials in side_by_side(simulation, trials) {
        let first = values.len();
        values.resize(first + trials.len() * n_values, f64::NAN);
        let rows = &mut values[first..];
        let mut episodes = Episodes::new(simulation, phenotype, trial_set, trials)?;
        for step in 0..simulation.n_steps {
            if !keep_going() {
                return Ok(None);
            }
            let mut rows = rows.chunks_exact_mut(n_values);
            let start = 1 + step as usize * names.len();
            episodes.step(step, |trial, _, _| {
                let metrics = trial.metrics(step);
                let row = rows.next().expect("a row per trial");
                for (value, name) in row[start..].iter_mut().zip(names) {
                    *value = metrics.get(name).copied().unwrap_or(f64::NAN);
                }
            })?;
        }
        for (row, trial) in rows.chunks_exact_mut(n_values).zip(&episodes.trials) {
            row[0] = trial.fitness();
        }
    }
    Ok(Some(values))
}

/// Parts of the trials that are simulated at once.
fn side_by_side(simulation: &Simulation, trials: Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let n_at_once = (MAX_LANES / simulation.world.n_robots().max(1)).max(1);
    let end = trials.end;
    trials
        .step_by(n_at_once)
        .map(move |first| first..end.min(first.saturating_add(n_at_once as u32)))
}

/// Simulates the episode of one trial and shows each of its steps to `observe`.
pub(crate) fn watch(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trial: u32,
    observe: &mut dyn FnMut(StepRecord),
) -> Result<EpisodeSummary, EvaluateError> {
    let mut episodes = Episodes::new(simulation, phenotype, trial_set, trial..trial + 1)?;
    let mut sums: IndexMap<&'static str, (f64, u32)> = IndexMap::new();
    for step in 0..simulation.n_steps {
        episodes.step(step, |trial, brains, fitness| {
            let mut record = trial.record(step, fitness);
            for brain in brains {
                brain.record(&mut record);
            }
            for (name, value) in &record.metrics {
                let (sum, n) = sums.entry(name).or_default();
                *sum += value;
                *n += 1;
            }
            observe(record);
        })?;
    }
    let means = sums.into_iter().map(|(name, (sum, n))| (name, sum / f64::from(n)));
    Ok(EpisodeSummary { fitness: episodes.trials[0].fitness(), metrics: means.collect() })
}

/// Trials that share a phenotype.
struct Episodes<'a> {
    trials: Vec<Trial<'a>>,
    /// Per group of robots.
    brains: Vec<Brain<'a>>,
}

impl<'a> Episodes<'a> {
    fn new(
        simulation: &'a Simulation,
        phenotype: &Phenotype,
        trial_set: TrialSet,
        trials: Range<u32>,
    ) -> Result<Self, EvaluateError> {
        let trials = trials.map(|trial| Trial::new(simulation, trial_set, trial));
        let trials = trials.collect::<Result<Vec<_>, _>>()?;
        let groups = 0..simulation.world.groups.len();
        let brain = |group| Brain::new(simulation, group, phenotype, trials.len());
        let brains = groups.map(brain).collect();
        Ok(Self { trials, brains })
    }

    /// One environment step; `see` gets each trial when its step has been judged.
    fn step(
        &mut self,
        step: u32,
        mut see: impl FnMut(&Trial<'_>, &[Brain<'_>], Option<f64>),
    ) -> Result<(), EvaluateError> {
        for trial in &mut self.trials {
            trial.sense(step)?;
        }
        for brain in &mut self.brains {
            brain.decide(&mut self.trials);
        }
        for trial in &mut self.trials {
            let fitness = trial.act(step);
            see(trial, &self.brains, fitness);
            trial.move_lights(step);
        }
        Ok(())
    }
}

/// The controller of a group of robots, and its stimuli; one lane per trial and
/// robot, trial by trial.
struct Brain<'a> {
    group: usize,
    robots: Range<usize>,
    controller: Box<dyn Controller + 'a>,
    stimuli: Lanes,
}

impl<'a> Brain<'a> {
    fn new(
        simulation: &'a Simulation,
        group_index: usize,
        phenotype: &Phenotype,
        n_trials: usize,
    ) -> Self {
        let group = &simulation.world.groups[group_index];
        let n_lanes = n_trials * group.robots.len();
        let n_inputs = group.stimuli.last().map_or(0, |(_, inputs)| inputs.end);
        let controller: Box<dyn Controller> = match group.controller {
            RobotController::NeuralController => Box::new(NeuralController::new(
                simulation.isa,
                &simulation.network,
                phenotype,
                n_lanes,
            )),
            RobotController::BraitenbergLightFollower => {
                Box::new(BraitenbergLightFollower::new(n_inputs, n_lanes))
            }
        };
        Self {
            group: group_index,
            robots: group.robots.clone(),
            controller,
            stimuli: Lanes::new(n_inputs, n_lanes),
        }
    }

    /// Decides what the group's robots do in this step.
    fn decide(&mut self, trials: &mut [Trial<'_>]) {
        let n_robots = self.robots.len();
        for (index, trial) in trials.iter().enumerate() {
            trial.stimulate(self.group, index * n_robots, &mut self.stimuli);
        }
        self.controller.perceive(&self.stimuli);
        for (index, trial) in trials.iter_mut().enumerate() {
            trial.decide(self.group, index * n_robots, &mut *self.controller);
        }
    }

    /// Adds the stimuli of the first trial's robots.
    fn record(&self, record: &mut StepRecord) {
        for (lane, robot) in record.robots[self.robots.clone()].iter_mut().enumerate() {
            robot.stimuli = self.stimuli.column(lane).map(f64::from).collect();
        }
    }
}

#[cfg(test)]
mod tests;

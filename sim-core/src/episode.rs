//! Episodes: all trials of one genotype, step by step and side by side, so that
//! their networks share one pass over the weights.

use std::ops::Range;

use crate::config::RobotController;
use crate::controllers::{BraitenbergLightFollower, Controller, NeuralController};
use crate::experiment::{EvaluateError, Experiment};
use crate::lanes::Lanes;
use crate::network::Phenotype;
use crate::trial::Trial;

/// Simulates one episode per trial and returns their fitness, in order.
pub(crate) fn run(
    experiment: &Experiment,
    phenotype: &Phenotype,
    generation: u64,
    trials: Range<u32>,
) -> Result<Vec<f64>, EvaluateError> {
    let trials = trials.map(|trial| Trial::new(experiment, generation, trial));
    let mut trials = trials.collect::<Result<Vec<_>, _>>()?;
    let groups = 0..experiment.world.groups.len();
    let mut brains: Vec<Brain<'_>> =
        groups.map(|group| Brain::new(experiment, group, phenotype, trials.len())).collect();
    for step in 0..experiment.n_steps {
        for trial in &mut trials {
            trial.sense(step)?;
        }
        for brain in &mut brains {
            brain.step(&mut trials);
        }
        for trial in &mut trials {
            trial.act(step);
        }
    }
    Ok(trials.iter().map(Trial::fitness).collect())
}

/// The controller of a group of robots, and its stimuli; one lane per trial and
/// robot, trial by trial.
struct Brain<'a> {
    group: usize,
    n_robots: usize,
    controller: Box<dyn Controller + 'a>,
    stimuli: Lanes,
}

impl<'a> Brain<'a> {
    fn new(
        experiment: &'a Experiment,
        group_index: usize,
        phenotype: &Phenotype,
        n_trials: usize,
    ) -> Self {
        let group = &experiment.world.groups[group_index];
        let n_lanes = n_trials * group.robots.len();
        let n_inputs = group.stimuli.last().map_or(0, |(_, inputs)| inputs.end);
        let controller: Box<dyn Controller> = match group.controller {
            RobotController::NeuralController => {
                Box::new(NeuralController::new(&experiment.network, phenotype, n_lanes))
            }
            RobotController::BraitenbergLightFollower => {
                Box::new(BraitenbergLightFollower::new(n_inputs, n_lanes))
            }
        };
        Self {
            group: group_index,
            n_robots: group.robots.len(),
            controller,
            stimuli: Lanes::new(n_inputs, n_lanes),
        }
    }

    fn step(&mut self, trials: &mut [Trial<'_>]) {
        for (index, trial) in trials.iter().enumerate() {
            trial.stimulate(self.group, index * self.n_robots, &mut self.stimuli);
        }
        self.controller.perceive(&self.stimuli);
        for (index, trial) in trials.iter_mut().enumerate() {
            trial.decide(self.group, index * self.n_robots, &mut *self.controller);
        }
    }
}

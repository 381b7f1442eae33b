//! Episodes: all trials of one genotype, step by step and side by side, so that
//! their networks share one pass over the weights.

use std::ops::Range;

use crate::controllers::{Controller, NeuralController};
use crate::experiment::{EvaluateError, Experiment};
use crate::lanes::Lanes;
use crate::network::Phenotype;
use crate::trial::Trial;
use crate::world::RobotGroup;

/// Simulates one episode per trial and returns their fitness, in order.
pub(crate) fn run(
    experiment: &Experiment,
    phenotype: &Phenotype,
    generation: u64,
    trials: Range<u32>,
) -> Result<Vec<f64>, EvaluateError> {
    let trials = trials.map(|trial| Trial::new(experiment, generation, trial));
    let mut trials = trials.collect::<Result<Vec<_>, _>>()?;
    let groups = experiment.world.groups.iter();
    let mut brains: Vec<Brain<'_>> =
        groups.map(|group| Brain::new(experiment, group, phenotype, trials.len())).collect();
    for step in 0..experiment.n_steps {
        for trial in &mut trials {
            trial.sense();
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
    group: &'a RobotGroup,
    controller: Box<dyn Controller + 'a>,
    stimuli: Lanes,
}

impl<'a> Brain<'a> {
    fn new(
        experiment: &'a Experiment,
        group: &'a RobotGroup,
        phenotype: &Phenotype,
        n_trials: usize,
    ) -> Self {
        let n_lanes = n_trials * group.robots.len();
        let network = &experiment.network;
        Self {
            group,
            controller: Box::new(NeuralController::new(network, phenotype, n_lanes)),
            stimuli: Lanes::new(network.n_inputs(), n_lanes),
        }
    }

    fn step(&mut self, trials: &mut [Trial<'_>]) {
        let n_robots = self.group.robots.len();
        for (index, trial) in trials.iter().enumerate() {
            trial.stimulate(self.group, index * n_robots, &mut self.stimuli);
        }
        self.controller.perceive(&self.stimuli);
        for (index, trial) in trials.iter_mut().enumerate() {
            trial.decide(self.group, index * n_robots, &mut *self.controller);
        }
    }
}

//! Simulates all trials of one genotype step by step and side by side, so that their networks
//! share one pass over the weights.

mod described;
mod recorder;
mod witness;

pub(crate) use described::Described;
pub(crate) use recorder::{AllMeasures, FitnessOnly, Recorder, Viewer};
pub(crate) use witness::testify;

use std::ops::Range;

use crate::controllers::{BraitenbergLightFollower, Controller, NeuralController, Scripted};
use crate::lanes::Lanes;
use crate::network::Phenotype;
use crate::record::StepRecord;
use crate::simulation::{EvaluateError, Simulation};
use crate::trial::{Trial, encoding_streams};
use determinism::random::TrialSet;
use experiment_file::RobotController;

/// Most lanes side by side: enough to share the weights, few enough to stay in the cache.
const MAX_LANES: usize = 256;

/// Simulates one episode per trial, and shows each step to `recorder`. Calls `keep_going` before
/// every step, and every few milliseconds of a script. Returns false once `keep_going` has returned
/// false.
pub(crate) fn run(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trials: Range<u32>,
    keep_going: &dyn Fn() -> bool,
    recorder: &mut impl Recorder,
) -> Result<bool, EvaluateError> {
    let first = trials.start;
    for trials in side_by_side(simulation, trials) {
        let first = (trials.start - first) as usize;
        match run_together(simulation, phenotype, trial_set, trials, first, keep_going, recorder) {
            Ok(true) => {}
            Ok(false) => return Ok(false),
            // The stop itself may have caused the error. A stopped episode has no result.
            Err(EvaluateError::Script { .. }) if !keep_going() => return Ok(false),
            Err(error) => return Err(error),
        }
    }
    Ok(true)
}

/// Simulates trials side by side; the first episode has the number `first`.
fn run_together(
    simulation: &Simulation,
    phenotype: &Phenotype,
    trial_set: TrialSet,
    trials: Range<u32>,
    first: usize,
    keep_going: &dyn Fn() -> bool,
    recorder: &mut impl Recorder,
) -> Result<bool, EvaluateError> {
    let mut episodes = Episodes::new(simulation, phenotype, trial_set, trials, keep_going)?;
    for step in 0..simulation.n_steps {
        if !keep_going() {
            return Ok(false);
        }
        episodes.step(step, first, recorder)?;
    }
    for (episode, trial) in (first..).zip(&mut episodes.trials) {
        trial.end()?;
        recorder.end(episode, trial);
    }
    Ok(true)
}

/// Divides the trials into parts to simulate side by side.
fn side_by_side(simulation: &Simulation, trials: Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let n_at_once = (MAX_LANES / simulation.world.n_robots().max(1)).max(1);
    let end = trials.end;
    trials
        .step_by(n_at_once)
        .map(move |first| first..end.min(first.saturating_add(n_at_once as u32)))
}

/// Trials that share a phenotype.
struct Episodes<'a> {
    trials: Vec<Trial<'a>>,
    /// Per group of robots.
    controllers: Vec<GroupController<'a>>,
}

impl<'a> Episodes<'a> {
    fn new(
        simulation: &'a Simulation,
        phenotype: &Phenotype,
        trial_set: TrialSet,
        trials: Range<u32>,
        keep_going: &'a dyn Fn() -> bool,
    ) -> Result<Self, EvaluateError> {
        let trials = trials.map(|trial| Trial::new(simulation, trial_set, trial, keep_going));
        let trials = trials.collect::<Result<Vec<_>, _>>()?;
        let groups = 0..simulation.world.groups.len();
        let controller = |group| GroupController::new(simulation, group, phenotype, &trials);
        let controllers = groups.map(controller).collect();
        Ok(Self { trials, controllers })
    }

    /// One environment step; the first of these episodes has the number `first`.
    fn step(
        &mut self,
        step: u32,
        first: usize,
        recorder: &mut impl Recorder,
    ) -> Result<(), EvaluateError> {
        for trial in &mut self.trials {
            trial.sense(step)?;
        }
        for controller in &mut self.controllers {
            controller.decide(&mut self.trials);
        }
        for (episode, trial) in (first..).zip(&mut self.trials) {
            let fitness = trial.act(step)?;
            recorder.step(episode, step, trial, &self.controllers, fitness)?;
            trial.move_things(step)?;
        }
        Ok(())
    }
}

/// The controller of a group of robots, and its stimuli; one lane per trial and
/// robot, trial by trial.
pub(crate) struct GroupController<'a> {
    group: usize,
    robots: Range<usize>,
    controller: Box<dyn Controller + 'a>,
    stimuli: Lanes,
    /// Whether it learns from reward.
    is_learning: bool,
}

impl<'a> GroupController<'a> {
    fn new(
        simulation: &'a Simulation,
        group_index: usize,
        phenotype: &Phenotype,
        trials: &[Trial<'_>],
    ) -> Self {
        let group = &simulation.world.groups[group_index];
        let n_lanes = trials.len() * group.robots.len();
        let n_inputs = group.stimuli.last().map_or(0, |(_, inputs)| inputs.end);
        let controller: Box<dyn Controller> = match group.controller {
            RobotController::NeuralController => Box::new(NeuralController::new(
                simulation.isa,
                &simulation.network,
                phenotype,
                n_lanes,
                encoding_streams(simulation, trials, group_index),
            )),
            RobotController::BraitenbergLightFollower => {
                Box::new(BraitenbergLightFollower::new(n_inputs, n_lanes))
            }
            RobotController::ScriptController => Box::new(Scripted),
        };
        Self {
            group: group_index,
            robots: group.robots.clone(),
            controller,
            stimuli: Lanes::new(n_inputs, n_lanes),
            is_learning: simulation.network.learning.is_some(),
        }
    }

    /// Decides the actions of the group's robots in this step.
    fn decide(&mut self, trials: &mut [Trial<'_>]) {
        let n_robots = self.robots.len();
        for (index, trial) in trials.iter().enumerate() {
            trial.stimulate(self.group, index * n_robots, &mut self.stimuli);
            if self.is_learning {
                trial.reward(self.group, index * n_robots, &mut *self.controller);
            }
        }
        self.controller.perceive(&self.stimuli);
        for (index, trial) in trials.iter_mut().enumerate() {
            trial.decide(self.group, index * n_robots, &mut *self.controller);
        }
    }

    /// Fills in the stimuli of the first trial's robots, and the activity of their neurons.
    fn record(&self, record: &mut StepRecord) {
        let refill = |list: &mut Vec<f64>, lanes: Option<&Lanes>, lane| {
            list.clear();
            if let Some(lanes) = lanes {
                list.extend(lanes.column(lane).map(f64::from));
            }
        };
        let (activity, voltages) = (self.controller.activity(), self.controller.voltages());
        for (lane, robot) in record.robots[self.robots.clone()].iter_mut().enumerate() {
            refill(&mut robot.stimuli, Some(&self.stimuli), lane);
            refill(&mut robot.activity, activity.as_ref(), lane);
            refill(&mut robot.voltages, voltages.as_ref(), lane);
        }
    }
}

#[cfg(test)]
mod tests;

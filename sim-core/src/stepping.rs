//! Steps episodes whose robots get their actions from the caller.

use std::ops::Range;

use crate::communication::Mode;
use crate::controllers::{
    Action, BraitenbergLightFollower, Controller, NeuralController, Scripted,
};
use crate::lanes::Lanes;
use crate::simulation::{EvaluateError, Simulation};
use crate::trial::{Trial, encoding_streams};
use determinism::random::{Stream, TrialSet};
use experiment_file::RobotController;

/// Trials of an experiment side by side. The caller decides for the *agents*, the robots with a
/// network: it reads their stimuli and sets their actions. Robots with another controller decide
/// for themselves.
///
/// With the actions of [`decide`](Self::decide), fitness and everything else have the same bits as
/// in [`Simulation::simulate`].
pub struct Stepper<'a> {
    simulation: &'a Simulation,
    trials: Vec<Trial<'a>>,
    groups: Vec<Group<'a>>,
    n_agents: usize,
    /// Whether each agent emits nothing in this step, `[trial][agent]`.
    silent: Vec<bool>,
    step: u32,
}

/// The robots of one object.
struct Group<'a> {
    index: usize,
    robots: Range<usize>,
    /// `[input][lane]`, one lane per trial and robot, trial by trial.
    stimuli: Lanes,
    n_inputs: usize,
    decider: Decider<'a>,
}

enum Decider<'a> {
    /// The caller decides. `first_agent`: number of agents before this group in each trial.
    Caller { first_agent: usize },
    /// The robots decide for themselves.
    Own(Box<dyn Controller + 'a>),
}

/// The actions of the agents of all trials in one step: arrays of shape `[trial][agent]`,
/// flattened, and `[trial][agent][component]` for messages.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Actions {
    /// Right and left wheel, in \[-1, 1\].
    pub wheels: Vec<[f64; 2]>,
    /// Colour of the LED, 0 off.
    pub leds: Vec<u32>,
    /// Whether the robot sends its own message; otherwise it relays.
    pub sends: Vec<bool>,
    /// Message, before quantisation, in \[0, 1\].
    pub messages: Vec<f64>,
}

/// The network of a genotype, in all trials of a [`Stepper`], with its state.
pub struct Policy<'a> {
    /// The controller of each group; `None` where robots decide for themselves.
    controllers: Vec<Option<NeuralController<'a>>>,
}

/// Why a step failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StepError {
    /// An array has the wrong length.
    #[error("expected {expected} {what}, found {actual}")]
    Length {
        /// The elements of the array.
        what: &'static str,
        /// The required number.
        expected: usize,
        /// The given number.
        actual: usize,
    },
    /// An action is outside its range or not finite.
    #[error("{what} number {index} is {value}, not within {range}")]
    Range {
        /// The kind of value.
        what: &'static str,
        /// Its index in the array.
        index: usize,
        /// Its value.
        value: f64,
        /// The allowed range.
        range: &'static str,
    },
    /// The episode is over.
    #[error("the episode has ended after {0} steps; begin another one")]
    Over(u32),
    /// The simulation failed, for example because robots find no place.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// The controller that gives agents the actions of the caller.
struct Commanded<'a> {
    actions: &'a Actions,
    /// The agent of the first lane.
    first_agent: usize,
    first_lane: usize,
    message_len: usize,
}

impl Controller for Commanded<'_> {
    fn perceive(&mut self, _: &Lanes) {}

    fn act(&mut self, lane: usize, _: &mut Stream, action: &mut Action<'_>) {
        let agent = self.first_agent + lane - self.first_lane;
        *action.wheels = self.actions.wheels[agent];
        *action.led = self.actions.leds[agent];
        *action.mode = if self.actions.sends[agent] { Mode::Send } else { Mode::Relay };
        let message = &self.actions.messages[agent * self.message_len..][..self.message_len];
        action.message.copy_from_slice(message);
    }
}

impl<'a> Stepper<'a> {
    /// Creates the trials before their first step; agents have their first stimuli.
    ///
    /// # Errors
    ///
    /// If the range of trials is empty or beyond the limit, if an object finds no place, or if
    /// the script fails.
    pub fn new(
        simulation: &'a Simulation,
        trial_set: TrialSet,
        trials: Range<u32>,
    ) -> Result<Self, EvaluateError> {
        simulation.check_trials(&trials)?;
        let trials = trials.map(|trial| Trial::new(simulation, trial_set, trial, &|| true));
        let trials = trials.collect::<Result<Vec<_>, _>>()?;
        let mut n_agents = 0;
        let groups = simulation.world.groups.iter().enumerate().map(|(index, group)| {
            let n_lanes = trials.len() * group.robots.len();
            let n_inputs = group.stimuli.last().map_or(0, |(_, inputs)| inputs.end);
            let decider = match group.controller {
                RobotController::NeuralController => {
                    n_agents += group.robots.len();
                    Decider::Caller { first_agent: n_agents - group.robots.len() }
                }
                RobotController::BraitenbergLightFollower => {
                    Decider::Own(Box::new(BraitenbergLightFollower::new(n_inputs, n_lanes)))
                }
                RobotController::ScriptController => Decider::Own(Box::new(Scripted)),
            };
            let stimuli = Lanes::new(n_inputs, n_lanes);
            Group { index, robots: group.robots.clone(), stimuli, n_inputs, decider }
        });
        let groups = groups.collect();
        let silent = vec![false; trials.len() * n_agents];
        let mut this = Self { simulation, trials, groups, n_agents, silent, step: 0 };
        this.sense()?;
        Ok(this)
    }

    /// The numbers of the agents among all robots.
    pub fn agents(&self) -> Vec<usize> {
        self.commanded().flat_map(|group| group.robots.clone()).collect()
    }

    /// Number of inputs of an agent; the largest, if groups differ.
    pub fn n_inputs(&self) -> usize {
        self.commanded().map(|group| group.n_inputs).max().unwrap_or(0)
    }

    /// Components of a message; 0 without radio.
    pub fn message_len(&self) -> usize {
        self.simulation.world.message_len
    }

    /// Number of environment steps so far.
    pub fn n_steps_done(&self) -> u32 {
        self.step
    }

    /// The stimuli of the agents, flattened, shape `[trial][agent][input]`; NaN for inputs that an
    /// agent lacks. After the last step, these are still the stimuli of that step.
    pub fn stimuli(&self) -> Vec<f32> {
        let width = self.n_inputs();
        let mut values = Vec::with_capacity(self.trials.len() * self.n_agents * width);
        for (group, lane) in self.lanes_of_agents() {
            let group = &self.groups[group];
            values.extend((0..group.n_inputs).map(|input| group.stimuli.get(input, lane)));
            values.extend((group.n_inputs..width).map(|_| f32::NAN));
        }
        values
    }

    /// Replaces the agents' stimuli in this step, which [`decide`](Self::decide) reads; flattened,
    /// shape `[trial][agent][input]`. Radios still relay the frames that they heard. Values of
    /// inputs that an agent lacks are ignored, and inhibited stimuli become zero.
    ///
    /// # Errors
    ///
    /// If the array has the wrong length, or a value that is not finite.
    pub fn set_stimuli(&mut self, stimuli: &[f32]) -> Result<(), StepError> {
        let width = self.n_inputs();
        let lanes = self.lanes_of_agents();
        let (expected, actual) = (lanes.len() * width, stimuli.len());
        if expected != actual {
            return Err(StepError::Length { what: "stimuli", expected, actual });
        }
        let agents = || lanes.iter().zip(stimuli.chunks_exact(width.max(1))).enumerate();
        for (agent, (&(group, _), values)) in agents() {
            let given = &values[..self.groups[group].n_inputs];
            if let Some(input) = given.iter().position(|value| !value.is_finite()) {
                let (index, value) = (agent * width + input, given[input].into());
                return Err(StepError::Range {
                    what: "stimulus",
                    index,
                    value,
                    range: "the finite numbers",
                });
            }
        }
        for (_, (&(group, lane), values)) in agents() {
            let group = &mut self.groups[group];
            for (input, &value) in values[..group.n_inputs].iter().enumerate() {
                group.stimuli.set(input, lane, value);
            }
        }
        for (index, trial) in self.trials.iter().enumerate() {
            for group in &mut self.groups {
                trial.inhibit(group.index, index * group.robots.len(), &mut group.stimuli);
            }
        }
        Ok(())
    }

    /// Silences agents in this step: they emit neither their own message nor a frame to relay,
    /// and others hear the next strongest emitter instead. Flattened, shape `[trial][agent]`.
    ///
    /// # Errors
    ///
    /// If the array has the wrong length.
    pub fn silence(&mut self, silent: &[bool]) -> Result<(), StepError> {
        let (expected, actual) = (self.silent.len(), silent.len());
        if expected != actual {
            return Err(StepError::Length { what: "silence flags", expected, actual });
        }
        self.silent.copy_from_slice(silent);
        Ok(())
    }

    /// Whether agents sent their own message in the previous step, flattened, shape
    /// `[trial][agent]`. The result follows their actions, except in the first steps and under
    /// perturbations.
    pub fn sent(&self) -> Vec<bool> {
        let agents = self.agents();
        self.trials
            .iter()
            .flat_map(|trial| agents.iter().map(|&agent| trial.has_sent(agent)))
            .collect()
    }

    /// The network of a genotype, at rest, for the trials of this stepper.
    ///
    /// # Errors
    ///
    /// If the genotype has the wrong length, or a gene outside \[0, 1\].
    pub fn policy(&self, genotype: &[f64]) -> Result<Policy<'a>, EvaluateError> {
        let simulation = self.simulation;
        let phenotype = simulation.phenotype(genotype)?;
        let controllers = self.groups.iter().map(|group| {
            let n_lanes = self.trials.len() * group.robots.len();
            let network = &simulation.network;
            matches!(group.decider, Decider::Caller { .. }).then(|| {
                let streams = encoding_streams(simulation, &self.trials, group.index);
                NeuralController::new(simulation.isa, network, &phenotype, n_lanes, streams)
            })
        });
        Ok(Policy { controllers: controllers.collect() })
    }

    /// The network's actions for the agents in this step. This method draws random decisions from
    /// the trials' streams, as [`Simulation::simulate`] does, so call it once per step.
    pub fn decide(&mut self, policy: &mut Policy<'_>) -> Actions {
        for (group, controller) in self.groups.iter().zip(&mut policy.controllers) {
            let Some(controller) = controller else { continue };
            for (index, trial) in self.trials.iter().enumerate() {
                trial.reward(group.index, index * group.robots.len(), controller);
            }
            controller.perceive(&group.stimuli);
            for (index, trial) in self.trials.iter_mut().enumerate() {
                trial.decide(group.index, index * group.robots.len(), controller);
            }
        }
        let mut actions = Actions::default();
        for trial in &self.trials {
            for group in self.commanded() {
                trial.add_actions(group.robots.clone(), &mut actions);
            }
        }
        actions
    }

    /// Runs one environment step. Returns its fitness in each trial; `None` where the step does
    /// not count.
    ///
    /// # Errors
    ///
    /// If the episode has ended, if an action has the wrong length or range, or if the simulation
    /// fails.
    pub fn step(&mut self, actions: &Actions) -> Result<Vec<Option<f64>>, StepError> {
        if self.step >= self.simulation.n_steps {
            return Err(StepError::Over(self.step));
        }
        self.check(actions)?;
        let (n_agents, message_len) = (self.n_agents, self.message_len());
        for group in &mut self.groups {
            let n_robots = group.robots.len();
            if let Decider::Own(controller) = &mut group.decider {
                controller.perceive(&group.stimuli);
            }
            for (index, trial) in self.trials.iter_mut().enumerate() {
                let first_lane = index * n_robots;
                match &mut group.decider {
                    Decider::Caller { first_agent } => {
                        let first_agent = index * n_agents + *first_agent;
                        let mut commanded =
                            Commanded { actions, first_agent, first_lane, message_len };
                        trial.decide(group.index, first_lane, &mut commanded);
                    }
                    Decider::Own(controller) => {
                        trial.decide(group.index, first_lane, &mut **controller);
                    }
                }
            }
        }
        let step = self.step;
        let n_steps = self.simulation.n_steps;
        let fitness = self.trials.iter_mut().map(|trial| {
            let fitness = trial.act(step)?;
            trial.move_things(step)?;
            if step + 1 == n_steps {
                trial.end()?;
            }
            Ok(fitness)
        });
        let fitness = fitness.collect::<Result<_, EvaluateError>>()?;
        let agents = self.agents();
        for (index, trial) in self.trials.iter_mut().enumerate() {
            let silent = &self.silent[index * n_agents..][..n_agents];
            let robots = agents.iter().zip(silent).filter(|(_, silent)| **silent);
            trial.silence(robots.map(|(robot, _)| *robot));
        }
        self.silent.fill(false);
        self.step += 1;
        if self.step < self.simulation.n_steps {
            self.sense()?;
        }
        Ok(fitness)
    }

    /// Fitness of each trial so far: the mean over the steps that count, unless a script computes
    /// another value at the end.
    pub fn fitness(&self) -> Vec<f64> {
        self.trials.iter().map(Trial::fitness).collect()
    }

    /// The groups of agents.
    fn commanded(&self) -> impl Iterator<Item = &Group<'a>> {
        self.groups.iter().filter(|group| matches!(group.decider, Decider::Caller { .. }))
    }

    /// Group and lane of each agent, trial by trial.
    fn lanes_of_agents(&self) -> Vec<(usize, usize)> {
        let groups = self.groups.iter().enumerate();
        let groups = groups.filter(|(_, group)| matches!(group.decider, Decider::Caller { .. }));
        let of_trial = |trial| {
            groups.clone().flat_map(move |(index, group)| {
                let n_robots = group.robots.len();
                (0..n_robots).map(move |robot| (index, trial * n_robots + robot))
            })
        };
        (0..self.trials.len()).flat_map(of_trial).collect()
    }

    fn sense(&mut self) -> Result<(), EvaluateError> {
        for (index, trial) in self.trials.iter_mut().enumerate() {
            trial.sense(self.step)?;
            for group in &mut self.groups {
                trial.stimulate(group.index, index * group.robots.len(), &mut group.stimuli);
            }
        }
        Ok(())
    }

    fn check(&self, actions: &Actions) -> Result<(), StepError> {
        let Actions { wheels, leds, sends, messages } = actions;
        let n = self.trials.len() * self.n_agents;
        let lengths = [
            ("wheels", n, wheels.len()),
            ("LEDs", n, leds.len()),
            ("modes", n, sends.len()),
            ("components of messages", n * self.message_len(), messages.len()),
        ];
        for (what, expected, actual) in lengths {
            if expected != actual {
                return Err(StepError::Length { what, expected, actual });
            }
        }
        let wheels = wheels.iter().flatten().enumerate();
        let wheel = wheels.map(|(index, value)| ("wheel", index, *value, "[-1, 1]"));
        let message = messages.iter().enumerate();
        let message = message.map(|(index, value)| ("message component", index, *value, "[0, 1]"));
        for (what, index, value, range) in wheel.chain(message) {
            let least = if what == "wheel" { -1.0 } else { 0.0 };
            if !(least..=1.0).contains(&value) {
                return Err(StepError::Range { what, index, value, range });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;

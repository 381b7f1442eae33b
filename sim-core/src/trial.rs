//! One trial of an experiment: the phases of its environment steps, except the controllers.

mod address;
mod interior;
mod realities;
mod record;
mod starts;
mod watched;
mod witness;

use std::{mem, ops::Range};

use crate::communication::{Mode, Radio};
use crate::controllers::Controller;
use crate::fitness::{Fitness, Moment};
use crate::lanes::Lanes;
use crate::lights::LightPath;
use crate::neighbours::Neighbours;
use crate::objects::Switches;
use crate::perturbations::Perturbations;
use crate::script::{May, ScriptRun, View};
use crate::senses::Senses;
use crate::sensors::Surroundings;
use crate::simulation::{EvaluateError, Simulation};
use crate::stepping::Actions;
use crate::swarm::Swarm;
use crate::torus::Vec2;
use crate::world::World;
use determinism::Isa;
use determinism::random::{Purpose, Stream, TrialSet};
use experiment_file::SensorQuery;
use task_script::ScriptError;

use self::address::Address;
pub(crate) use self::interior::Interior;
use self::realities::Realities;
use self::starts::Starts;
pub(crate) use self::starts::{room, try_places};
use self::watched::Watched;

/// State of a trial.
pub(crate) struct Trial<'a> {
    world: &'a World,
    address: Address,
    isa: Isa,
    swarm: Swarm,
    neighbours: Neighbours,
    /// The neighbours whose frames nothing blocks, where something may.
    audible: Option<Neighbours>,
    /// `None` in a world without bodies.
    interior: Option<Interior>,
    radio: Radio,
    lights: Vec<Vec2>,
    light_paths: Vec<LightPath>,
    areas: Vec<Vec2>,
    switches: Switches,
    /// The state of each group of robots, in addition to the swarm's.
    groups: Vec<Group>,
    /// `None` without pseudo-reality.
    realities: Option<Realities>,
    /// `None` without interventions.
    watched: Option<Watched<'a>>,
    /// Streams for stochastic decoding, per robot.
    decoding: Vec<Stream>,
    /// `None`: the script computes the fitness.
    fitness: Option<Box<dyn Fitness>>,
    script: Option<ScriptRun<'a>>,
    /// Whether to continue; a stopped script fails.
    goes_on: &'a dyn Fn() -> bool,
    n_steps: u32,
    /// Fitness of the last step, 0 if it does not count.
    reward: f64,
    fitness_sum: f64,
    n_scored_steps: u32,
    /// Fitness of the whole episode, if it is not the mean over the steps.
    of_episode: Option<f64>,
}

/// The state of a group of robots.
pub(crate) struct Group {
    /// Their readings.
    pub senses: Senses,
    /// Their perturbations.
    pub perturbations: Perturbations,
    /// Stream for start positions, and for those after each switch of the topology.
    positions: Stream,
}

/// Random streams of the encoders of a group's robots, trial by trial; empty if no encoder draws.
pub(crate) fn encoding_streams(
    simulation: &Simulation,
    trials: &[Trial<'_>],
    group: usize,
) -> Vec<Stream> {
    if simulation.network.n_drawing() == 0 {
        return Vec::new();
    }
    let of_trial = |trial: &Trial<'_>| {
        let (robots, address) = (trial.world.groups[group].robots.clone(), trial.address);
        robots.map(move |robot| address.stream(Purpose::Encoding, robot))
    };
    trials.iter().flat_map(of_trial).collect()
}

impl<'a> Trial<'a> {
    /// The trial before its first step. Once `goes_on` returns false, a script fails at once.
    pub fn new(
        simulation: &'a Simulation,
        trial_set: TrialSet,
        trial: u32,
        goes_on: &'a dyn Fn() -> bool,
    ) -> Result<Self, EvaluateError> {
        let world = &simulation.world;
        let address = Address { seed: simulation.seed, trial_set, trial };
        let Starts { positions, headings, streams, lights, areas, interior } =
            Starts::draw(address, world)?;
        let mut groups = Vec::with_capacity(world.groups.len());
        for (group, positions) in world.groups.iter().zip(streams) {
            let perturbations = Perturbations::new(
                &group.perturbations,
                group.robots.len(),
                |number| address.stream(Purpose::Perturbation, number),
                || address.stream(Purpose::PseudoReality, group.site.object),
            );
            let noise = |purpose, number| address.numbered_stream(purpose, number);
            let senses = Senses::new(group, &perturbations, noise);
            groups.push(Group { senses, perturbations, positions });
        }
        let controllers = world.lights.iter().zip(&world.light_controllers);
        let controllers = controllers
            .flat_map(|(lights, controller)| lights.members.clone().map(move |_| controller));
        let paths = controllers.zip(&lights).enumerate().map(|(light, (controller, &position))| {
            let stream = address.stream(Purpose::LightMovement, light);
            LightPath::new(controller, position, &world.torus, stream)
        });
        let light_paths = paths.collect();
        let n_robots = world.n_robots();
        let mut swarm = Swarm::new(positions, headings, world.message_len);
        for (group, state) in world.groups.iter().zip(&groups) {
            for (index, robot) in group.robots.clone().enumerate() {
                swarm.photosensitive[robot] = group.has_sensor(SensorQuery::Light)
                    && !state.perturbations.inhibits(index, SensorQuery::Light);
            }
        }
        let realities = Realities::new(world, &groups, address);
        if let Some(realities) = &realities {
            realities.begin(world, &groups, &mut swarm);
        }
        let antennas = Realities::antennas(world, &groups);
        let radio = Radio::new(
            world,
            &antennas,
            address.streams(Purpose::Reception, n_robots),
            address.streams(Purpose::Quantisation, n_robots),
        );
        Ok(Self {
            world,
            address,
            isa: simulation.isa,
            swarm,
            neighbours: Neighbours::new(world.sensing_range(&antennas), n_robots),
            audible: world.has_shadows().then(|| Neighbours::new(0.0, n_robots)),
            interior,
            radio,
            switches: Switches { lights: vec![true; lights.len()], areas: vec![true; areas.len()] },
            lights,
            light_paths,
            areas,
            groups,
            realities,
            watched: Watched::new(&simulation.interventions, world),
            decoding: address.streams(Purpose::Decoding, n_robots),
            fitness: simulation
                .fitness
                .map(|definition| (definition.start)(world, &simulation.fitness_params)),
            script: match &simulation.script {
                Some(task) => {
                    let stream = |purpose, number| address.stream(purpose, number);
                    let started = ScriptRun::start(task, world, goes_on, stream);
                    Some(started.map_err(|error| address.failed(error, 0))?)
                }
                None => None,
            },
            goes_on,
            n_steps: simulation.n_steps,
            reward: 0.0,
            fitness_sum: 0.0,
            n_scored_steps: 0,
            of_episode: None,
        })
    }

    /// Start of a step: every robot senses at its present position and heading, and hears the
    /// frames on the air. The script plans the actions of its robots.
    pub fn sense(&mut self, step: u32) -> Result<(), EvaluateError> {
        let mut moved = mem::replace(&mut self.swarm.moved, false);
        let mut turned = mem::replace(&mut self.swarm.turned, false);
        // Interventions and switches of the topology are changes of this step, for its score, too.
        self.intervene(step)?;
        for (group, state) in self.world.groups.iter().zip(&mut self.groups) {
            if state.perturbations.switches_topology(step) {
                let torus = &self.world.torus;
                let positions = self.address.place(&group.site, torus, &mut state.positions)?;
                self.swarm.positions[group.robots.clone()].copy_from_slice(&positions);
                self.swarm.moved = true;
            }
        }
        moved |= self.swarm.moved;
        turned |= self.swarm.turned;
        // Neighbours change only when a robot moves, and hearing only when a robot moves or
        // turns.
        if moved {
            self.neighbours.update(&self.world.torus, &self.swarm.positions);
            if !self.swarm.removed.is_empty() {
                self.neighbours.retain(|_, neighbour| !self.swarm.is_removed(neighbour.robot));
            }
        }
        if let (true, Some(audible), Some(interior)) = (moved, &mut self.audible, &self.interior) {
            audible.copy(&self.neighbours);
            interior.retain_audible(self.world, &self.swarm.positions, audible);
        }
        let audible = self.audible.as_ref().unwrap_or(&self.neighbours);
        if moved || turned {
            if let Some(realities) = &self.realities {
                realities.turn_antennas(&mut self.swarm);
            }
            self.radio.listen(audible, &self.swarm);
        }
        self.radio.receive(audible, &mut self.swarm);
        if let Some(realities) = &mut self.realities {
            realities.receive(&mut self.swarm);
        }
        if let Some(watched) = &self.watched {
            watched.deafen(&mut self.swarm);
        }
        for (group, state) in self.world.groups.iter().zip(&mut self.groups) {
            let surroundings = Surroundings {
                torus: &self.world.torus,
                swarm: &self.swarm,
                neighbours: &self.neighbours,
                lights: &self.lights,
                areas: &self.areas,
                switches: &self.switches,
                bodies: self.interior.as_ref().map(|interior| &interior.bodies),
            };
            state.senses.update(group, &self.swarm, &surroundings);
        }
        self.sense_by_script(step)?;
        self.run_script(step, ScriptRun::control)?;
        Ok(())
    }

    /// The script computes the readings of robots with a `script_sensor`.
    fn sense_by_script(&mut self, step: u32) -> Result<(), EvaluateError> {
        self.run_script(step, ScriptRun::sense)?;
        for (robot, reading) in self.script.iter().flat_map(ScriptRun::sensed) {
            let number = self.world.group_of(robot);
            let group = &self.world.groups[number];
            self.groups[number].senses.take(group, robot - group.robots.start, reading);
        }
        Ok(())
    }

    /// Fills in the stimuli of a group, `[input][lane]`, from `first_lane` on.
    /// Inhibited stimuli are zero.
    pub fn stimulate(&self, group: usize, first_lane: usize, stimuli: &mut Lanes) {
        let Group { senses, perturbations, .. } = &self.groups[group];
        let group = &self.world.groups[group];
        for (query, inputs) in &group.stimuli {
            for (value, input) in inputs.clone().enumerate() {
                let row = &mut stimuli.row_mut(input)[first_lane..][..group.robots.len()];
                senses.write(*query, value, group.robots.clone(), &self.swarm, row);
                perturbations.inhibit(*query, row);
            }
        }
    }

    /// Zeroes inhibited stimuli of a group that the caller has filled in.
    pub fn inhibit(&self, group: usize, first_lane: usize, stimuli: &mut Lanes) {
        let perturbations = &self.groups[group].perturbations;
        let group = &self.world.groups[group];
        for (query, inputs) in &group.stimuli {
            for input in inputs.clone() {
                let row = &mut stimuli.row_mut(input)[first_lane..][..group.robots.len()];
                perturbations.inhibit(*query, row);
            }
        }
    }

    /// Gives a group's controller the rewards of its robots for the previous step.
    pub fn reward(&self, group: usize, first_lane: usize, controller: &mut dyn Controller) {
        let n_robots = self.world.groups[group].robots.len();
        (first_lane..first_lane + n_robots).for_each(|lane| controller.reward(lane, self.reward));
    }

    /// Takes a group's actions from its controller.
    pub fn decide(&mut self, group: usize, first_lane: usize, controller: &mut dyn Controller) {
        let robots = self.world.groups[group].robots.clone();
        for (lane, robot) in (first_lane..).zip(robots) {
            let mut action = self.swarm.fresh_action(robot);
            match self.script.as_ref().and_then(|script| script.plan(robot)) {
                Some(plan) => plan.carry_out(&mut action),
                None => controller.act(lane, &mut self.decoding[robot], &mut action),
            }
        }
    }

    /// Adds the decided actions of robots in this step.
    pub fn add_actions(&self, robots: Range<usize>, actions: &mut Actions) {
        for robot in robots {
            actions.wheels.push(self.swarm.wheels[robot]);
            actions.leds.push(self.swarm.leds[robot]);
            actions.sends.push(self.swarm.modes[robot] == Mode::Send);
            actions.messages.extend(&self.swarm.messages[self.swarm.message_range(robot)]);
        }
    }

    /// Whether a robot sent its own message in the last scored step.
    pub fn has_sent(&self, robot: usize) -> bool {
        self.swarm.modes[robot] == Mode::Send
    }

    /// Carries out and scores the actions; returns the fitness of the step, `None` if it does not
    /// count.
    pub fn act(&mut self, step: u32) -> Result<Option<f64>, EvaluateError> {
        let world = self.world;
        // Frames have to spread before relaying makes sense.
        for group in world.groups.iter().filter(|group| step < group.sending_steps) {
            self.swarm.modes[group.robots.clone()].fill(Mode::Send);
        }
        // Perturbations rewrite actions.
        for (group, state) in world.groups.iter().zip(&mut self.groups) {
            state.perturbations.rewrite(step, group, &mut self.swarm);
        }
        self.swarm.stop_failed();
        if let Some(watched) = &self.watched {
            watched.stop(&mut self.swarm);
        }
        // Wheels turn, in a pseudo-reality otherwise than they are told.
        if let Some(realities) = &mut self.realities {
            realities.turn_wheels(&mut self.swarm.wheels);
        }
        self.drive();
        if let Some(realities) = &mut self.realities {
            realities.tell_wheels(&mut self.swarm.wheels);
        }
        // Every transmitter puts its frame on the air.
        for group in &world.groups {
            self.radio.emit(self.isa, world, &mut self.swarm, group);
        }
        self.react(step)?;
        // The step is scored.
        let fitness = match &mut self.fitness {
            Some(fitness) => fitness.step(&Moment::new(world, &self.swarm, &self.lights, step)),
            None => self.run_script(step, ScriptRun::fitness)?.flatten(),
        };
        self.reward = fitness.unwrap_or(0.0);
        if let Some(fitness) = fitness {
            self.fitness_sum += fitness;
            self.n_scored_steps += 1;
        }
        Ok(fitness)
    }

    /// The script changes robots, lights and areas after the actions.
    fn react(&mut self, step: u32) -> Result<(), EvaluateError> {
        if self.run_script(step, ScriptRun::react)?.is_some() {
            self.silence(std::iter::empty());
        }
        Ok(())
    }

    /// Silences further robots in the next step.
    pub fn silence(&mut self, robots: impl Iterator<Item = usize>) {
        let mut silent = self.swarm.failed.clone();
        robots.for_each(|robot| silent[robot] = true);
        self.mute(&silent);
    }

    fn mute(&mut self, silent: &[bool]) {
        if self.radio.mute(silent) {
            // Now other robots are the loudest, so hearing changes.
            self.swarm.turned = true;
        }
    }

    /// Runs a function of the script on this step, if there is a script.
    fn run_script<T>(
        &mut self,
        step: u32,
        run: impl FnOnce(&mut ScriptRun<'a>, View<'_>) -> Result<T, ScriptError>,
    ) -> Result<Option<T>, EvaluateError> {
        let Some(script) = &mut self.script else { return Ok(None) };
        let Self { world, swarm, lights, areas, switches, interior, groups, .. } = self;
        let view = View {
            world,
            swarm,
            lights,
            areas,
            switches,
            interior: interior.as_mut(),
            groups,
            step,
            n_steps: self.n_steps,
            may: May::Look,
            goes_on: self.goes_on,
            kept: None,
        };
        run(script, view).map(Some).map_err(|error| self.address.failed(error, step))
    }

    /// Ends the episode after its last step.
    pub fn end(&mut self) -> Result<(), EvaluateError> {
        if self.fitness.is_none() {
            let last = self.n_steps.saturating_sub(1);
            self.of_episode = self.run_script(last, ScriptRun::last)?.flatten();
        }
        Ok(())
    }

    /// End of a step: lights and ground areas move.
    pub fn move_things(&mut self, step: u32) -> Result<(), EvaluateError> {
        let watched = self.watched.as_ref();
        let frozen = watched.map_or_else(Vec::new, |watched| watched.frozen_lights(&self.lights));
        self.run_script(step, ScriptRun::move_things)?;
        for (position, path) in self.lights.iter_mut().zip(&mut self.light_paths) {
            *position = path.advance(*position, step, &self.world.torus, &self.swarm.positions);
        }
        for (light, position) in frozen {
            self.lights[light] = position;
        }
        Ok(())
    }

    /// Fitness of the episode: the mean over the steps that count, 0 without any, unless the
    /// script computes it.
    pub fn fitness(&self) -> f64 {
        if let Some(fitness) = self.of_episode {
            fitness
        } else if self.n_scored_steps == 0 {
            0.0
        } else {
            self.fitness_sum / f64::from(self.n_scored_steps)
        }
    }

    /// Moves all robots by their wheels.
    fn drive(&mut self) {
        let swarm = &mut self.swarm;
        if let Some(interior) = &mut self.interior {
            interior.drive(self.world, swarm);
            return;
        }
        for group in &self.world.groups {
            let Some(drive) = &group.drive else { continue };
            for robot in group.robots.clone().filter(|&robot| swarm.wheels[robot] != [0.0; 2]) {
                let (position, heading) = (swarm.positions[robot], swarm.headings[robot]);
                let pose = drive.advance(&self.world.torus, position, heading, swarm.wheels[robot]);
                swarm.moved |= pose.0 != position;
                swarm.turned |= pose.1 != heading;
                (swarm.positions[robot], swarm.headings[robot]) = pose;
            }
        }
    }
}

#[cfg(test)]
mod tests;

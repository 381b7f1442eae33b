//! One trial of an experiment: the phases of its environment steps, except what
//! controllers do.

use crate::communication::{Ether, Hearing, Mode, Origin};
use crate::config::SensorQuery;
use crate::controllers::Controller;
use crate::experiment::{EvaluateError, Experiment};
use crate::fitness::{self, Fitness, Moment};
use crate::lanes::Lanes;
use crate::perturbations::LeaderFailure;
use crate::random::{Purpose, Stream};
use crate::swarm::{Received, Swarm};
use crate::torus::{Vec2, sector_angle};
use crate::world::{RobotGroup, World};

/// Steps at the start of an episode in which every robot sends.
const N_FIRST_STEPS_SENDING: u32 = 10;

/// State of a trial.
pub(crate) struct Trial<'a> {
    world: &'a World,
    swarm: Swarm,
    ether: Ether,
    hearing: Hearing,
    streams: Streams,
    /// Per group of robots.
    leader_failures: Vec<Option<LeaderFailure>>,
    fitness: Box<dyn Fitness>,
    fitness_sum: f64,
    n_judged_steps: u32,
    /// Scratch of the quantiser.
    weights: Vec<f64>,
}

/// Random streams per robot.
struct Streams {
    reception: Vec<Stream>,
    quantisation: Vec<Stream>,
    decoding: Vec<Stream>,
}

impl<'a> Trial<'a> {
    /// The trial before its first step.
    pub fn new(
        experiment: &'a Experiment,
        generation: u64,
        trial: u32,
    ) -> Result<Self, EvaluateError> {
        let world = &experiment.world;
        let stream = |purpose, number| {
            Stream::new(experiment.seed, generation, u64::from(trial), purpose, number)
        };
        let per_robot =
            |purpose| (0..world.n_robots() as u64).map(|robot| stream(purpose, robot)).collect();
        let mut positions = Vec::with_capacity(world.n_robots());
        let mut headings = Vec::with_capacity(world.n_robots());
        for group in &world.groups {
            let mut start = stream(Purpose::Positions, group.object);
            let start = group.positions.draw(&world.torus, &mut start);
            positions.extend(start.map_err(|unplaceable| EvaluateError::Unplaceable {
                object: group.name.clone(),
                index: unplaceable.index,
                generation,
                trial,
            })?);
            headings.extend(group.headings.draw(&mut stream(Purpose::Orientations, group.object)));
        }
        let leader_failures = world.groups.iter().map(|group| {
            let config = group.perturbations.leader_failure.as_ref()?;
            Some(LeaderFailure::new(config.time_to_failure, group.robots.len()))
        });
        let swarm = Swarm::new(positions, headings, world.message_len);
        let mut hearing = Hearing::new(&world.antennas);
        hearing.update(&world.torus, &world.antennas, &swarm.positions, &swarm.headings);
        Ok(Self {
            world,
            swarm,
            ether: Ether::new(world.n_robots(), world.message_len),
            hearing,
            streams: Streams {
                reception: per_robot(Purpose::Reception),
                quantisation: per_robot(Purpose::Quantisation),
                decoding: per_robot(Purpose::Decoding),
            },
            leader_failures: leader_failures.collect(),
            fitness: fitness::new(experiment.fitness),
            fitness_sum: 0.0,
            n_judged_steps: 0,
            weights: Vec::new(),
        })
    }

    /// First half of a step: every robot senses, from positions and headings now
    /// and from the frames on the air.
    pub fn sense(&mut self) {
        for robot in 0..self.world.n_robots() {
            self.receive(robot);
        }
    }

    /// Fills in a group's stimuli, `[input][lane]`, from lane `first_lane` on.
    pub fn stimulate(&self, group: &RobotGroup, first_lane: usize, stimuli: &mut Lanes) {
        for (lane, robot) in (first_lane..).zip(group.robots.clone()) {
            for (query, inputs) in &group.stimuli {
                self.read(*query, robot, |index, value| {
                    stimuli.set(inputs.start + index, lane, value);
                });
            }
        }
    }

    /// Takes a group's actions from its controller.
    pub fn decide(
        &mut self,
        group: &RobotGroup,
        first_lane: usize,
        controller: &mut dyn Controller,
    ) {
        for (lane, robot) in (first_lane..).zip(group.robots.clone()) {
            let mut action = self.swarm.fresh_action(robot);
            controller.act(lane, &mut self.streams.decoding[robot], &mut action);
        }
    }

    /// Second half of a step: actions take effect and are judged.
    pub fn act(&mut self, step: u32) {
        // Nobody relays before there is something to relay.
        if step < N_FIRST_STEPS_SENDING {
            self.swarm.modes.fill(Mode::Send);
        }
        // Perturbations rewrite actions.
        for (group, failure) in self.world.groups.iter().zip(&mut self.leader_failures) {
            if let Some(failure) = failure {
                let robots = group.robots.clone();
                failure
                    .rewrite(&mut self.swarm.leds[robots.clone()], &mut self.swarm.modes[robots]);
            }
        }
        // Every transmitter puts its frame on the air.
        let world = self.world;
        for group in &world.groups {
            for robot in group.robots.clone() {
                self.emit(group, robot);
            }
        }
        // Fitness of the step.
        let judged = self.world.groups[self.world.evolvable].robots.clone();
        let moment = Moment { leds: &self.swarm.leds[judged] };
        if let Some(fitness) = self.fitness.step(&moment) {
            self.fitness_sum += fitness;
            self.n_judged_steps += 1;
        }
    }

    /// Mean fitness over the steps that count.
    pub fn fitness(&self) -> f64 {
        if self.n_judged_steps == 0 {
            0.0
        } else {
            self.fitness_sum / f64::from(self.n_judged_steps)
        }
    }

    /// Chooses among the frames in the robot's sectors.
    fn receive(&mut self, robot: usize) {
        let Some(receiver) = self.world.antennas[robot].receiver else { return };
        let ether = &self.ether;
        let accepted =
            |origin: &&Origin| origin.originator != robot && origin.hops < receiver.max_hops;
        let mut valid = self.hearing.of(robot).iter().enumerate().filter_map(|(sector, heard)| {
            let heard = heard.as_ref()?;
            ether.origin(heard.emitter).filter(accepted).map(|origin| (sector, heard, origin))
        });
        let u = self.streams.reception[robot].uniform();
        let count = valid.clone().count();
        let chosen = valid.nth(((u * count as f64) as usize).min(count.saturating_sub(1)));
        let message = self.swarm.message_range(robot);
        let message = &mut self.swarm.received_messages[message];
        let Some((sector, heard, origin)) = chosen else {
            self.swarm.received[robot] = None;
            message.fill(0.0);
            return;
        };
        message.copy_from_slice(ether.message(heard.emitter));
        // The first to hear a frame sees the direction in which it was sent.
        let sending_direction =
            if origin.hops == 1 { heard.sending_direction } else { origin.sending_direction };
        self.swarm.received[robot] = Some(Received {
            sector,
            signal: heard.strength,
            receiving_direction: Vec2::unit(sector_angle(sector, receiver.n_sectors)),
            origin: Origin { sending_direction, ..*origin },
        });
    }

    /// Hands a robot's reading to `set`, value by value.
    fn read(&self, query: SensorQuery, robot: usize, mut set: impl FnMut(usize, f64)) {
        let received = self.swarm.received[robot].as_ref();
        let mut direction = |direction: Option<Vec2>| {
            let direction = direction.unwrap_or_default();
            set(0, direction.x);
            set(1, direction.y);
        };
        match query {
            SensorQuery::ReceiverMessage => {
                let message = &self.swarm.received_messages[self.swarm.message_range(robot)];
                for (index, &value) in message.iter().enumerate() {
                    set(index, value);
                }
            }
            SensorQuery::ReceiverReceivingDirection => {
                direction(received.map(|received| received.receiving_direction));
            }
            SensorQuery::ReceiverSendingDirection => {
                direction(received.map(|received| received.origin.sending_direction));
            }
            SensorQuery::ReceiverSignal => set(0, received.map_or(0.0, |r| r.signal)),
            SensorQuery::ReceiverState => {
                set(0, f64::from(self.swarm.modes[robot] == Mode::Send));
            }
            SensorQuery::Light | SensorQuery::Distance | SensorQuery::Ground => {}
        }
    }

    /// Puts a robot's frame on the air.
    fn emit(&mut self, group: &RobotGroup, robot: usize) {
        if self.world.antennas[robot].emits_within.is_none() {
            return;
        }
        let range = self.swarm.message_range(robot);
        if let Some(quantiser) = &group.quantiser {
            let u = self.streams.quantisation[robot].uniform();
            quantiser.quantise(&mut self.swarm.messages[range.clone()], u, &mut self.weights);
        }
        match self.swarm.modes[robot] {
            Mode::Send => {
                let origin =
                    Origin { originator: robot, hops: 1, sending_direction: Vec2::default() };
                self.ether.emit(robot, Some(origin), &self.swarm.messages[range]);
            }
            Mode::Relay => {
                let origin = self.swarm.received[robot]
                    .map(|Received { origin, .. }| Origin { hops: origin.hops + 1, ..origin });
                self.ether.emit(robot, origin, &self.swarm.received_messages[range]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{ExperimentConfig, Initializer};
    use crate::testing::{experiment_a, robot};

    /// Robots with heading 0 in a line, 90 cm apart: each hears its neighbours.
    fn line(n: u32) -> ExperimentConfig {
        let mut config = experiment_a();
        config.world.width = 5000.0;
        let robot = robot(&mut config);
        robot.num_instances = n;
        let values = (0..n).map(|index| vec![100.0 + 90.0 * f64::from(index), 500.0]).collect();
        robot.initializers.positions = Initializer::Fixed { values };
        robot.initializers.orientations = Initializer::Fixed { values: vec![vec![0.0]] };
        robot.perturbations.leader_failure = None;
        config
    }

    /// One step in which robots act as `modes` and `message` say.
    fn step(trial: &mut Trial<'_>, modes: &[Mode], message: [f64; 2]) {
        trial.sense();
        trial.swarm.modes.copy_from_slice(modes);
        for own in trial.swarm.messages.chunks_exact_mut(2) {
            own.copy_from_slice(&message);
        }
        trial.act(N_FIRST_STEPS_SENDING);
    }

    #[test]
    fn a_frame_crosses_a_line_one_hop_per_step_and_dies_at_max_hops() {
        let experiment = Experiment::compile(&line(14)).unwrap();
        let mut trial = Trial::new(&experiment, 0, 0).unwrap();
        let mut modes = [Mode::Relay; 14];
        modes[0] = Mode::Send;
        step(&mut trial, &modes, [1.0, 0.0]);
        for hop in 1..30 {
            step(&mut trial, &[Mode::Relay; 14], [0.0, 1.0]);
            assert_eq!(trial.swarm.received[0], None, "a frame came home after {hop} hops");
            for robot in hop + 1..14 {
                assert_eq!(trial.swarm.received[robot], None, "step {hop}, robot {robot}");
            }
            if hop > 9 {
                assert!(trial.swarm.received.iter().all(Option::is_none), "step {hop}");
                continue;
            }
            let received = trial.swarm.received[hop].unwrap();
            let origin =
                Origin { originator: 0, hops: hop as u32, sending_direction: Vec2::new(1.0, 0.0) };
            assert_eq!(received.origin, origin);
            assert_eq!(received.sector, 2);
            assert!((received.receiving_direction.x + 1.0).abs() < 1e-15);
            assert!((received.signal - libm::exp(-0.05 * 90.0)).abs() < 1e-15);
            assert_eq!(trial.swarm.received_messages[2 * hop..2 * hop + 2], [1.0, 0.0]);
        }
    }

    #[test]
    fn nothing_is_heard_in_the_first_step_and_everyone_sends_in_the_first_ten() {
        let experiment = Experiment::compile(&line(2)).unwrap();
        let mut trial = Trial::new(&experiment, 0, 0).unwrap();
        for step in 0..12 {
            trial.sense();
            // On the air: the frames of step - 1.
            let heard = (1..=10).contains(&step);
            assert_eq!(trial.swarm.received[0].is_some(), heard, "step {step}");
            trial.swarm.modes.fill(Mode::Relay);
            trial.act(step);
        }
    }

    #[test]
    fn readings_without_a_frame_are_zero_and_the_state_is_the_mode() {
        let experiment = Experiment::compile(&line(2)).unwrap();
        let mut trial = Trial::new(&experiment, 0, 0).unwrap();
        let read = |trial: &Trial<'_>, query| {
            let mut values = Vec::new();
            trial.read(query, 0, |_, value| values.push(value));
            values
        };
        trial.sense();
        assert_eq!(read(&trial, SensorQuery::ReceiverState), [1.0]);
        assert_eq!(read(&trial, SensorQuery::ReceiverMessage), [0.0; 2]);
        assert_eq!(read(&trial, SensorQuery::ReceiverSignal), [0.0]);
        assert_eq!(read(&trial, SensorQuery::ReceiverReceivingDirection), [0.0; 2]);
        assert_eq!(read(&trial, SensorQuery::ReceiverSendingDirection), [0.0; 2]);
        trial.swarm.messages.copy_from_slice(&[0.0, 0.0, 1.0, 0.0]);
        trial.act(0);
        trial.swarm.modes[0] = Mode::Relay;
        trial.sense();
        assert_eq!(read(&trial, SensorQuery::ReceiverState), [0.0]);
        assert_eq!(read(&trial, SensorQuery::ReceiverMessage), [1.0, 0.0]);
        assert_eq!(read(&trial, SensorQuery::ReceiverSignal), [libm::exp(-4.5)]);
        assert_eq!(read(&trial, SensorQuery::ReceiverReceivingDirection), [1.0, 0.0]);
        let sent = read(&trial, SensorQuery::ReceiverSendingDirection);
        assert!((sent[0] + 1.0).abs() < 1e-15 && sent[1].abs() < 1e-15, "{sent:?}");
    }

    #[test]
    fn the_chosen_frame_is_uniform_among_the_sectors_with_a_valid_one() {
        let experiment = Experiment::compile(&line(3)).unwrap();
        let mut trial = Trial::new(&experiment, 0, 0).unwrap();
        step(&mut trial, &[Mode::Send; 3], [0.0; 2]);
        let mut from_right = 0;
        for _ in 0..2000 {
            step(&mut trial, &[Mode::Send; 3], [0.0; 2]);
            from_right += usize::from(trial.swarm.received[1].unwrap().sector == 0);
        }
        assert!((900..1100).contains(&from_right), "{from_right}");
        step(&mut trial, &[Mode::Send, Mode::Send, Mode::Relay], [0.0; 2]);
        for _ in 0..20 {
            // Robot 2 relays what robot 1 sent: of its neighbours, robot 1 can
            // accept robot 0's frames only.
            step(&mut trial, &[Mode::Send, Mode::Send, Mode::Relay], [0.0; 2]);
            assert_eq!(trial.swarm.received[1].unwrap().sector, 2);
        }
    }
}

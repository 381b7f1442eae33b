//! The world and the order of one step: sense, control, act, score, move lights.

use determinism::random::{Purpose, Stream};
use experiment_file::{
    ExperimentConfig, FitnessFunction, GroundAreaConfig, GroundAreaParams, Initializer,
    ObjectConfig, RobotConfig, RobotController,
};

use super::actuators::{self, Actions};
use super::communication::{Frame, Reception, quantise, receive};
use super::controller::Controller;
use super::fitness;
use super::initializers::{headings, positions};
use super::learning::Learner;
use super::lights::Light;
use super::perturbations::{SoleLeader, affected_robots, inhibits, rotation};
use super::reality;
use super::robot::Robot;
use super::sensors::{self, Readings};
use super::torus::{Torus, Vector};
use super::witness::Witness;

/// A coloured disc.
pub struct Area<'a> {
    pub position: Vector,
    pub params: &'a GroundAreaParams,
}

/// One trial of one genotype, step by step.
pub struct Simulation<'a> {
    config: &'a ExperimentConfig,
    torus: Torus,
    pub robots: Vec<Robot<'a>>,
    lights: Vec<Light<'a>>,
    areas: Vec<Area<'a>>,
    /// Per object of the world.
    position_streams: Vec<Stream>,
    leader: SoleLeader,
    /// Number of the next step.
    k: u32,
    pub witness: Witness,
}

impl<'a> Simulation<'a> {
    pub fn new(
        config: &'a ExperimentConfig,
        genotype: &[f64],
        generation: u64,
        trial: u32,
    ) -> Self {
        let world = &config.world;
        let network = Controller::decode(config, genotype);
        let mut simulation = Self {
            config,
            torus: Torus { width: world.width, height: world.height },
            robots: Vec::new(),
            lights: Vec::new(),
            areas: Vec::new(),
            position_streams: Vec::new(),
            leader: SoleLeader::default(),
            k: 0,
            witness: Witness::default(),
        };
        let stream = |purpose, stream| {
            Stream::new(config.seed, generation, u64::from(trial), purpose, stream as u64)
        };
        for (object_idx, object) in world.objects.values().enumerate() {
            simulation.position_streams.push(stream(Purpose::Positions, object_idx));
            match object {
                ObjectConfig::Robot(robots) => {
                    simulation.place_robots(robots, object_idx, &network, genotype, &stream);
                }
                ObjectConfig::LightSource(lights) => {
                    let initializer = &lights.initializers.positions;
                    for position in
                        simulation.draw_positions(object_idx, initializer, lights.num_instances)
                    {
                        let movement = stream(Purpose::LightMovement, simulation.lights.len());
                        let light = Light::new(lights, position, simulation.torus, movement);
                        simulation.lights.push(light);
                    }
                }
                ObjectConfig::GroundArea(areas) => {
                    let GroundAreaConfig { num_instances, controller, initializers, params } =
                        areas;
                    assert_eq!(*controller, None, "no equation is given");
                    let drawn = simulation.draw_positions(
                        object_idx,
                        &initializers.positions,
                        *num_instances,
                    );
                    simulation
                        .areas
                        .extend(drawn.into_iter().map(|position| Area { position, params }));
                }
                ObjectConfig::Wall(_) | ObjectConfig::Obstacle(_) | ObjectConfig::Movable(_) => {
                    panic!("no equation is given")
                }
            }
        }
        simulation
    }

    fn place_robots(
        &mut self,
        config: &'a RobotConfig,
        object_idx: usize,
        network: &Controller,
        genotype: &[f64],
        stream: &dyn Fn(Purpose, usize) -> Stream,
    ) {
        assert_eq!(config.controller, RobotController::NeuralController, "no equation is given");
        let n = config.num_instances;
        let perturbations = &config.perturbations;
        let draw_affected = |k: Option<u32>, place: usize| {
            let mut stream = stream(Purpose::Perturbation, place);
            affected_robots(n, k.unwrap_or(0), &mut stream)
        };
        let mut inhibiting = stream(Purpose::Perturbation, 1);
        let inhibited: Vec<Vec<bool>> = perturbations
            .stimuli_inhibition
            .iter()
            .map(|config| affected_robots(n, config.affected_robots, &mut inhibiting))
            .collect();
        let uncontrollable = draw_affected(
            perturbations.uncontrollable_rotation.as_ref().map(|config| config.affected_robots),
            3,
        );
        let first = self.robots.len();
        let mut realities = reality::of_object(config, object_idx, first, stream).into_iter();
        let positions = self.draw_positions(object_idx, &config.initializers.positions, n);
        let mut orientations = stream(Purpose::Orientations, object_idx);
        let headings = headings(&config.initializers.orientations, n, &mut orientations);
        for i in 0..n as usize {
            let number = self.robots.len();
            self.robots.push(Robot {
                config,
                object_idx,
                position: positions[i],
                heading: headings[i],
                network: network.clone(),
                learner: Learner::new(self.config, genotype),
                v: vec![0.0; network.n_rate_neurons()],
                spiking: network.rest(stream(Purpose::Encoding, number)),
                send: true,
                led: 0,
                wheels: [0.0, 0.0],
                on_air: config
                    .actuators
                    .wireless_transmitter
                    .as_ref()
                    .filter(|transmitter| transmitter.initial_frame)
                    .map(|transmitter| {
                        Frame::sent(vec![0.0; transmitter.msg_length as usize], number)
                    }),
                received: None,
                is_faulty: false,
                is_inhibited: inhibited.iter().map(|robots| robots[i]).collect(),
                is_uncontrollable: uncontrollable[i],
                reality: realities.next(),
                reception: stream(Purpose::Reception, number),
                quantisation: stream(Purpose::Quantisation, number),
                decoding: stream(Purpose::Decoding, number),
                noise: stream(Purpose::SensorNoise, number),
            });
        }
    }

    fn draw_positions(
        &mut self,
        object_idx: usize,
        initializer: &Initializer,
        n: u32,
    ) -> Vec<Vector> {
        positions(initializer, n, self.torus, &mut self.position_streams[object_idx])
    }

    /// One environment step; returns its fitness.
    pub fn step(&mut self) -> f64 {
        self.switch_topology();
        let readings: Vec<Readings> = (0..self.robots.len()).map(|i| self.sense(i)).collect();
        let mut actions = Vec::new();
        for (i, readings) in readings.iter().enumerate() {
            let phi = self.stimuli(i, readings);
            let actions_of_robot = self.control(i, &phi);
            actions.push(self.perturb(i, actions_of_robot));
        }
        for (i, (readings, actions)) in readings.into_iter().zip(actions).enumerate() {
            self.act(i, readings.reception, actions);
        }
        self.observe_leader();
        let fitness = self.fitness();
        if fitness != 0.0 {
            self.witness.n_rewarded += 1;
        }
        for learner in self.robots.iter_mut().filter_map(|robot| robot.learner.as_mut()) {
            learner.reward(fitness);
        }
        let robots: Vec<_> = self.robots.iter().map(|robot| robot.position).collect();
        for light in &mut self.lights {
            light.advance(self.k, self.torus, &robots);
        }
        self.k += 1;
        fitness
    }

    /// `topology_switch`: new positions in every `every`-th step except the first.
    fn switch_topology(&mut self) {
        for (object_idx, object) in self.config.world.objects.values().enumerate() {
            let ObjectConfig::Robot(config) = object else { continue };
            let Some(switch) = &config.perturbations.topology_switch else { continue };
            if self.k == 0 || !self.k.is_multiple_of(switch.every) {
                continue;
            }
            let initializer = &config.initializers.positions;
            let drawn = self.draw_positions(object_idx, initializer, config.num_instances);
            let robots = self.robots.iter_mut().filter(|robot| robot.object_idx == object_idx);
            for (robot, position) in robots.zip(drawn) {
                robot.position = position;
            }
            self.witness.n_redrawn += 1;
        }
    }

    /// Readings from positions and headings now, and from the frames that the
    /// last step put on the air.
    fn sense(&mut self, i: usize) -> Readings {
        let uniform = self.robots[i].reception.uniform();
        let mut reception = receive(i, &self.robots, self.torus, uniform);
        if let Some(reality) = &mut self.robots[i].reality {
            let had_frame = reception.is_some();
            reception = reality.received(reception);
            self.witness.n_lost += usize::from(had_frame && reception.is_none());
        }
        if let Some(reception) = &reception {
            self.witness.n_receptions += 1;
            self.witness.n_relayed_receptions += usize::from(reception.hops > 1);
            self.witness.max_hops = self.witness.max_hops.max(reception.hops);
            self.witness.n_choices += usize::from(reception.n_candidates > 1);
        }
        let mut noise = self.robots[i].noise.clone();
        let robot = &self.robots[i];
        let sensors = &robot.config.sensors;
        let light = sensors.light_sensor.as_ref().map_or(vec![], |config| {
            sensors::light(config, robot, &self.lights, self.torus, &mut noise)
        });
        let distance = sensors.distance_sensor.as_ref().map_or(vec![], |config| {
            sensors::distance(config, i, &self.robots, self.torus, &mut noise)
        });
        let on = |color: &str| sensors::ground(color, robot.position, &self.areas, self.torus);
        let ground = sensors.ground_sensor.as_ref().map(|config| on(&config.color));
        let food_area = sensors.food_area_sensor.as_ref().map(|_| on("green"));
        let nest = sensors.nest_sensor.as_ref().map(|_| on("black"));
        let mut distortion = robot.reality.as_ref().map(|reality| reality.noise.clone());
        let mut measure = |value: f64| match (&robot.reality, &mut distortion) {
            (Some(reality), Some(noise)) => reality.measured(value, noise),
            _ => value.clamp(0.0, 1.0),
        };
        let light: Vec<f64> = light.into_iter().map(&mut measure).collect();
        let distance: Vec<f64> = distance.into_iter().map(&mut measure).collect();
        let [ground, food_area, nest] =
            [ground, food_area, nest].map(|value| value.map_or(0.0, &mut measure));
        let neighborhood = sensors.neighborhood_pos_sensor.as_ref().map_or(vec![], |config| {
            sensors::neighborhood(config.n_neighbors as usize, i, &self.robots, self.torus)
        });
        let (position, orientation) = (robot.position, robot.heading / std::f64::consts::TAU);
        let state = if robot.send { 1.0 } else { 0.0 };
        self.robots[i].noise = noise;
        if let (Some(reality), Some(distortion)) = (&mut self.robots[i].reality, distortion) {
            reality.noise = distortion;
        }
        let n_not_zero = |values: &[f64]| values.iter().filter(|&&value| value != 0.0).count();
        self.witness.n_light += n_not_zero(&light);
        self.witness.n_distance += n_not_zero(&distance);
        self.witness.n_ground += n_not_zero(&[ground]);
        Readings {
            reception,
            state,
            light,
            distance,
            ground,
            food_area,
            nest,
            position,
            orientation,
            neighborhood,
        }
    }

    /// Eq. 3.8: the stimuli in their order, after `stimuli_inhibition`.
    fn stimuli(&mut self, i: usize, readings: &Readings) -> Vec<f64> {
        let robot = &self.robots[i];
        let inhibitions = &robot.config.perturbations.stimuli_inhibition;
        let mut phi = Vec::new();
        for (name, stimulus) in &self.config.topology.stimuli {
            let mut values = readings.get(stimulus.sensor, robot.msg_length());
            assert_eq!(values.len(), stimulus.n as usize, "length of stimulus {name}");
            let is_inhibited = inhibitions
                .iter()
                .zip(&robot.is_inhibited)
                .any(|(config, is_hit)| *is_hit && inhibits(config.stimuli, stimulus.sensor));
            if is_inhibited {
                self.witness.n_inhibited += usize::from(values.iter().any(|&value| value != 0.0));
                values.fill(0.0);
            }
            phi.extend(values);
        }
        phi
    }

    /// Eq. 3.16: network and decoding.
    fn control(&mut self, i: usize, phi: &[f64]) -> Actions {
        let robot = &mut self.robots[i];
        let msg_length = robot.msg_length();
        let topology = &self.config.topology;
        if let Some(learner) = &mut robot.learner {
            let weights = learner.learn();
            robot.network.set_weights(weights);
        }
        let mut actions = match &robot.network {
            Controller::Rate(network) => {
                let u = network.step(&mut robot.v, phi, self.k == 0);
                if let Some(learner) = &mut robot.learner {
                    learner.remember([&u[..], phi].concat());
                }
                actuators::decode(topology, &u, msg_length, &mut robot.decoding)
            }
            Controller::Spiking(network) => {
                let actions = network.step(topology, &mut robot.spiking, phi, msg_length);
                if let Some(learner) = &mut robot.learner {
                    learner.remember(robot.spiking.activities.clone());
                }
                actions
            }
        };
        if let Some(transmitter) = &robot.config.actuators.wireless_transmitter
            && self.k < transmitter.sending_steps
        {
            actions.send = Some(true);
        }
        actions
    }

    /// `pseudo_reality`, `leader_failure` and `uncontrollable_rotation`.
    fn perturb(&mut self, i: usize, mut actions: Actions) -> Actions {
        if let Some(reality) = &mut self.robots[i].reality {
            actions = reality.delayed(actions);
        }
        let robot = &self.robots[i];
        if robot.is_faulty {
            actions.led = 0;
            actions.send = Some(false);
        }
        if robot.is_uncontrollable
            && let Some(config) = &robot.config.perturbations.uncontrollable_rotation
            && let Some(wheels) = rotation(config, self.k, robot.heading)
        {
            actions.wheels = wheels;
            self.witness.n_uncontrollable += 1;
        }
        actions
    }

    /// Moves the wheels, switches the LED, and puts the new frame on the air.
    fn act(&mut self, i: usize, reception: Option<Reception>, actions: Actions) {
        let robot = &mut self.robots[i];
        robot.wheels = actions.wheels;
        if let Some(config) = &robot.config.actuators.wheel_actuator {
            actuators::drive(robot, config, self.torus);
        }
        robot.led = actions.led;
        robot.send = actions.send.unwrap_or(true);
        if let Some(config) = &robot.config.actuators.wireless_transmitter {
            let message = if config.quantize {
                quantise(&actions.message, config, robot.quantisation.uniform())
            } else {
                actions.message
            };
            robot.on_air = Some(if robot.send {
                Frame::sent(message, i)
            } else {
                Frame::relayed(reception.as_ref(), message.len())
            });
        }
        robot.received = reception;
        self.witness.n_sending += usize::from(robot.send);
        self.witness.n_relaying += usize::from(!robot.send);
        self.witness.n_lit += usize::from(robot.led > 0);
        self.witness.max_color = self.witness.max_color.max(robot.led);
    }

    /// Counts the steps of a sole leader. After `time_to_failure` steps, the leader is faulty from
    /// the next step on.
    fn observe_leader(&mut self) {
        let evaluated = self.evaluated_robots();
        let leds: Vec<u32> = self.robots[evaluated.clone()].iter().map(|robot| robot.led).collect();
        self.leader.observe(&leds);
        let Some(leader) = self.leader.robot else { return };
        let robot = &mut self.robots[evaluated][leader];
        if let Some(config) = &robot.config.perturbations.leader_failure
            && self.leader.n_steps >= config.time_to_failure
        {
            robot.is_faulty = true;
            self.witness.n_faults += 1;
        }
    }

    /// The robots that evolve; only these are evaluated.
    fn evaluated_robots(&self) -> std::ops::Range<usize> {
        let evolvable = &self.config.algorithm.evolvable_object;
        let object_idx = self.config.world.objects.get_index_of(evolvable);
        let is_evaluated = |robot: &Robot<'_>| Some(robot.object_idx) == object_idx;
        let first = self.robots.iter().take_while(|robot| !is_evaluated(robot)).count();
        first..first + self.robots.iter().filter(|robot| is_evaluated(robot)).count()
    }

    /// Fitness of the step, from its actions and from positions after moving.
    fn fitness(&mut self) -> f64 {
        let robots = &self.robots[self.evaluated_robots()];
        let params = &self.config.algorithm.fitness_params;
        match self.config.algorithm.fitness_function {
            FitnessFunction::IdentifyLeader => fitness::identify_leader(&self.leader),
            FitnessFunction::IdentifyBorderline => {
                let is_border = fitness::borderline_of_swarm(robots, self.torus, params.alpha);
                self.witness.n_interior +=
                    is_border.iter().filter(|&&is_border| !is_border).count();
                fitness::identify_borderline(robots, &is_border)
            }
            FitnessFunction::OrientationConsensus => fitness::orientation_consensus(robots),
            FitnessFunction::Alignment => fitness::alignment(robots),
            FitnessFunction::GotoLight => {
                fitness::goto_light(robots, &self.lights, self.torus, params.near)
            }
            FitnessFunction::Grouping => fitness::grouping(robots, self.torus),
            FitnessFunction::Script => unreachable!("scripts are compared with the functions"),
        }
    }
}

/// A relayed frame moves one hop per step along a line of robots 60 cm apart.
#[test]
fn a_relayed_frame_moves_one_hop_per_step() {
    let mut config = crate::configs::experiment_a();
    let swarm = crate::configs::swarm_mut(&mut config);
    swarm.num_instances = 4;
    swarm.initializers.positions =
        Initializer::Fixed { values: (0..4).map(|i| vec![60.0 * f64::from(i), 500.0]).collect() };
    let genotype = vec![0.5; super::genes(&config).len()];
    let mut simulation = Simulation::new(&config, &genotype, 0, 0);
    let torus = simulation.torus;
    for (i, robot) in simulation.robots.iter_mut().enumerate() {
        robot.heading = 0.3 * i as f64;
        robot.on_air =
            Some(if i == 0 { Frame::sent(vec![1.0, 0.0], 0) } else { Frame::relayed(None, 2) });
    }
    for step in 1..4usize {
        let heard: Vec<Option<Reception>> =
            (0..4).map(|i| receive(i, &simulation.robots, torus, 0.5)).collect();
        for (i, heard) in heard.iter().enumerate() {
            // The frame reaches robot i in step i, and from there also echoes back.
            assert_eq!(heard.is_some(), i > 0 && i <= step && (step - i) % 2 == 0, "{step} {i}");
        }
        let reception = heard[step].as_ref().expect("checked above");
        assert_eq!((reception.originator, reception.hops), (0, step as u32));
        assert_eq!(reception.message, [1.0, 0.0]);
        // Robot 0 heads east: its sector 0 faced robot 1, and every relayed frame carries this.
        assert_eq!(reception.original_direction, [1.0, 0.0]);
        for (robot, heard) in simulation.robots.iter_mut().zip(&heard) {
            robot.on_air = Some(Frame::relayed(heard.as_ref(), 2));
        }
    }
}

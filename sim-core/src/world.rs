//! The compiled world, which all episodes share.

use std::ops::Range;

use crate::blueprint::{Radio, RadioReceiver, Transmitter};
use crate::bodies::{Chassis, Room};
use crate::communication::{Antenna, Quantiser, Receiver};
use crate::drive::Drive;
use crate::initializers::{Headings, Positions};
use crate::network::Network;
use crate::objects::{Site, StaticObjects};
use crate::problems::Problems;
use crate::sensors::{self, Decay, MountedSensor};
use crate::torus::{Torus, Vec2};
use experiment_file::{
    AlgorithmConfig, BlockedBy, BodyConfig, Boundary, GroundAreaConfig, LightController,
    LightSourceConfig, ObjectConfig, PerturbationsConfig, RobotConfig, RobotController,
    SensorQuery, SensorsConfig, WorldConfig,
};

/// Communication range of robots without radio, cm.
const DEFAULT_RANGE: f64 = 100.0;

/// A torus and its objects.
#[derive(Debug, Clone)]
pub(crate) struct World {
    /// The plane.
    pub torus: Torus,
    /// Robots, object by object.
    pub groups: Vec<RobotGroup>,
    /// Antennas per robot.
    pub antennas: Vec<Antenna>,
    /// Lights, object by object.
    pub lights: Vec<StaticObjects>,
    /// The motion of the lights of each object.
    pub light_controllers: Vec<LightController>,
    /// Ground areas, object by object.
    pub areas: Vec<StaticObjects>,
    /// Components of a message; 0 without radio.
    pub message_len: usize,
    /// Index in `groups` of the robots that evolve and are evaluated.
    pub evolvable: usize,
    /// The parameter alpha of the swarm's border, in units of 1 / world width.
    pub alpha: f64,
    /// The room, in a world with bodies.
    pub room: Option<Room>,
}

/// The robots of one object.
#[derive(Debug, Clone)]
pub(crate) struct RobotGroup {
    /// Their object and start positions.
    pub site: Site,
    /// Their start headings.
    pub headings: Headings,
    /// Their numbers among all robots.
    pub robots: Range<usize>,
    /// Their controller.
    pub controller: RobotController,
    /// The readings that their controller gets, each with its range of inputs.
    pub stimuli: Vec<(SensorQuery, Range<usize>)>,
    /// All their readings, each with its number of values.
    pub readings: Vec<(SensorQuery, usize)>,
    /// Their sensors except the radio, in the order in which they draw noise.
    pub sensors: Vec<MountedSensor>,
    /// Their wheels; `None` if they stand still.
    pub drive: Option<Drive>,
    /// Whether they have an LED.
    pub has_led: bool,
    /// The quantiser of their messages.
    pub quantiser: Option<Quantiser>,
    /// Number of steps at the start of an episode in which they always send.
    pub sending_steps: u32,
    /// Whether each robot has a frame on the air before the first step.
    pub initial_frame: bool,
    /// Their perturbations.
    pub perturbations: PerturbationsConfig,
    /// What blocks frames on their way to them.
    pub frames_blocked_by: BlockedBy,
    /// Their bodies, in a world with bodies.
    pub chassis: Chassis,
}

impl RobotGroup {
    /// Whether the robots have a sensor, beside the radio, that gives the reading.
    pub fn has_sensor(&self, query: SensorQuery) -> bool {
        self.sensors.iter().any(|mounted| mounted.query == query)
    }
}

impl World {
    /// The sites of all objects.
    pub fn sites(&self) -> impl Iterator<Item = &Site> {
        let static_objects = self.lights.iter().chain(&self.areas);
        let robots = self.groups.iter().map(|group| &group.site);
        robots.chain(static_objects.map(|objects| &objects.site))
    }

    /// Compiles the objects; `algorithm.evolvable_object` names the robots to evaluate. `None` if
    /// there are no such robots.
    pub fn compile(
        config: &WorldConfig,
        algorithm: &AlgorithmConfig,
        network: &Network,
        problems: &mut Problems,
    ) -> Option<Self> {
        let evolvable_object = &algorithm.evolvable_object;
        let mut world = Self {
            torus: match config.boundary {
                Boundary::Torus => Torus::new(config.width, config.height),
                Boundary::Walls | Boundary::Polygon(_) => {
                    Torus::walled(config.width, config.height)
                }
            },
            groups: Vec::new(),
            antennas: Vec::new(),
            lights: Vec::new(),
            light_controllers: Vec::new(),
            areas: Vec::new(),
            message_len: 0,
            evolvable: 0,
            alpha: algorithm.fitness_params.alpha,
            room: Room::compile(config, problems),
        };
        // Sensors refer to lights and areas, which may come later than their robots.
        for (index, (name, object)) in config.objects.iter().enumerate() {
            match object {
                ObjectConfig::Robot(_) => {}
                ObjectConfig::LightSource(light) => world.add_lights(index, name, light, problems),
                ObjectConfig::GroundArea(area) => world.add_areas(index, name, area, problems),
                ObjectConfig::Wall(_) | ObjectConfig::Obstacle(_) | ObjectConfig::Movable(_) => {}
            }
        }
        let mut evolvable = None;
        for (index, (name, object)) in config.objects.iter().enumerate() {
            if let ObjectConfig::Robot(robot) = object {
                if name == evolvable_object {
                    evolvable = Some(world.groups.len());
                }
                world.add_robots(index, name, robot, network, problems);
            }
        }
        if evolvable.is_none() {
            let message = format!("no robots are named `{evolvable_object}`");
            problems.add("algorithm.evolvable_object", message);
        }
        Some(Self { evolvable: evolvable?, ..world })
    }

    /// The group of a robot.
    pub fn group_of(&self, robot: usize) -> usize {
        let group = self.groups.iter().position(|group| group.robots.contains(&robot));
        group.expect("every robot belongs to a group")
    }

    /// The robots whose actions a script decides.
    pub fn scripted_robots(&self) -> impl Iterator<Item = usize> {
        let is_scripted =
            |group: &&RobotGroup| group.controller == RobotController::ScriptController;
        self.groups.iter().filter(is_scripted).flat_map(|group| group.robots.clone())
    }

    /// Number of robots of all objects.
    pub fn n_robots(&self) -> usize {
        self.antennas.len()
    }

    /// Number of all lights.
    pub fn n_lights(&self) -> usize {
        self.lights.last().map_or(0, |lights| lights.members.end)
    }

    /// Number of all ground areas.
    pub fn n_areas(&self) -> usize {
        self.areas.last().map_or(0, |areas| areas.members.end)
    }

    /// The robots that evolve and are evaluated.
    pub fn evaluated(&self) -> Range<usize> {
        self.groups[self.evolvable].robots.clone()
    }

    /// Distance within which two of the evaluated robots hear each other, cm.
    pub fn communication_range(&self) -> f64 {
        let antenna = self.evaluated().next().map(|robot| self.antennas[robot]).unwrap_or_default();
        match (antenna.emits_within, antenna.receiver) {
            (Some(reach), Some(receiver)) => receiver.range.min(reach),
            _ => DEFAULT_RANGE,
        }
    }

    /// Distance beyond which no robot with these antennas senses another one, cm.
    pub fn sensing_range(&self, antennas: &[Antenna]) -> f64 {
        let receivers = antennas.iter().filter_map(|antenna| antenna.receiver);
        let sensors = self.groups.iter().flat_map(|group| &group.sensors);
        let ranges = receivers.map(|receiver| receiver.range);
        ranges.chain(sensors.map(|mounted| mounted.sensor.robots_within())).fold(0.0, f64::max)
    }

    /// The radio of the robots of a group, as numbers.
    pub fn radio_of(&self, group: &RobotGroup) -> Radio {
        let antenna = group.robots.clone().next().map(|robot| self.antennas[robot]);
        let antenna = antenna.unwrap_or_default();
        let receiver = antenna.receiver.map(|receiver| RadioReceiver {
            directions: receiver.directions().map(|Vec2 { x, y }| [x, y]).collect(),
            max_hops: receiver.max_hops,
            sending_direction: receiver.sending_direction,
        });
        let transmitter = antenna.emits_within.map(|_| Transmitter {
            quantiser: group.quantiser.as_ref().map(Quantiser::lattice),
            sending_steps: group.sending_steps,
            initial_frame: group.initial_frame,
        });
        Radio { message_len: self.message_len, receiver, transmitter }
    }

    /// Whether anything may be between a receiver and the robots that it hears.
    pub fn has_shadows(&self) -> bool {
        self.room.is_some()
            && self.groups.iter().any(|group| group.frames_blocked_by != BlockedBy::Nothing)
    }

    fn add_lights(
        &mut self,
        index: usize,
        name: &str,
        config: &LightSourceConfig,
        problems: &mut Problems,
    ) {
        let n = config.num_instances as usize;
        let positions = Positions::new(&config.initializers.positions, n);
        let Some(site) = Site::new(index, name, positions, problems) else { return };
        let members = self.n_lights()..self.n_lights() + n;
        let (range, color) = (config.params.range, config.params.color.clone());
        let by_script = config.controller == (LightController::ScriptController {});
        self.lights.push(StaticObjects { site, members, range, color, by_script });
        self.light_controllers.push(config.controller.clone());
    }

    fn add_areas(
        &mut self,
        index: usize,
        name: &str,
        config: &GroundAreaConfig,
        problems: &mut Problems,
    ) {
        let n = config.num_instances as usize;
        let positions = Positions::new(&config.initializers.positions, n);
        let Some(site) = Site::new(index, name, positions, problems) else { return };
        let members = self.n_areas()..self.n_areas() + n;
        let (range, color) = (config.params.range, config.params.color.clone());
        let by_script = config.controller.is_some();
        self.areas.push(StaticObjects { site, members, range, color, by_script });
    }

    fn add_robots(
        &mut self,
        index: usize,
        name: &str,
        config: &RobotConfig,
        network: &Network,
        problems: &mut Problems,
    ) {
        let n = config.num_instances as usize;
        let positions = Positions::new(&config.initializers.positions, n);
        let site = Site::new(index, name, positions, problems);
        let headings = Headings::new(&config.initializers.orientations, n)
            .map_err(|message| {
                problems.add(format!("world.objects.{name}.initializers.orientations"), message);
            })
            .ok();
        let (Some(site), Some(headings)) = (site, headings) else { return };
        let receiver = config.sensors.wireless_receiver.as_ref();
        let transmitter = config.actuators.wireless_transmitter.as_ref();
        // All robots share one ether, so all messages have one length.
        if let Some(len) =
            receiver.map(|r| r.msg_length).or(transmitter.map(|transmitter| transmitter.msg_length))
        {
            self.message_len = len as usize;
        }
        let stimuli = match config.controller {
            RobotController::NeuralController => {
                let stimuli = network.stimuli.values();
                stimuli.map(|stimulus| (stimulus.sensor, stimulus.inputs.clone())).collect()
            }
            RobotController::BraitenbergLightFollower => {
                let n_sectors = config.sensors.reading_len(SensorQuery::Light).unwrap_or(0);
                vec![(SensorQuery::Light, 0..n_sectors as usize)]
            }
            RobotController::ScriptController => Vec::new(),
        };
        let group = RobotGroup {
            site,
            headings,
            robots: self.n_robots()..self.n_robots() + n,
            controller: config.controller,
            stimuli,
            readings: readings(&config.sensors),
            sensors: sensors::mount(&config.sensors, self),
            drive: config.actuators.wheel_actuator.as_ref().map(|wheels| Drive {
                max_speed: wheels.max_speed,
                axle_length: wheels.axle_length,
                step_duration: wheels.step_duration,
            }),
            has_led: config.actuators.led_actuator.is_some(),
            quantiser: transmitter
                .filter(|transmitter| transmitter.quantize)
                .map(|t| Quantiser::new(t.msg_length as usize, t.n_levels() as usize, t.beta)),
            sending_steps: transmitter.map_or(0, |transmitter| transmitter.sending_steps),
            initial_frame: transmitter.is_some_and(|transmitter| transmitter.initial_frame),
            perturbations: config.perturbations.clone(),
            frames_blocked_by: receiver.map_or(BlockedBy::Nothing, |receiver| receiver.blocked_by),
            chassis: chassis(config),
        };
        self.antennas.extend(group.robots.clone().map(|_| antenna(config, network)));
        self.groups.push(group);
    }
}

fn chassis(config: &RobotConfig) -> Chassis {
    let BodyConfig { radius, mass, push_force } = config.body.unwrap_or_default();
    let wheels = config.actuators.wheel_actuator.as_ref();
    let axle_length = wheels.map_or(2.0 * radius, |wheels| wheels.axle_length);
    Chassis { radius, mass, push_force, axle_length }
}

/// The readings of robots with these sensors, each with its number of values.
fn readings(sensors: &SensorsConfig) -> Vec<(SensorQuery, usize)> {
    let reading = |&query: &SensorQuery| Some((query, sensors.reading_len(query)? as usize));
    SensorQuery::ALL.iter().filter_map(reading).collect()
}

fn antenna(robot: &RobotConfig, network: &Network) -> Antenna {
    let mut stimuli = network.stimuli.values().map(|stimulus| stimulus.sensor);
    let observes_sending_direction = robot.controller == RobotController::ScriptController
        || stimuli.any(|sensor| sensor == SensorQuery::ReceiverSendingDirection);
    let transmitter = robot.actuators.wireless_transmitter.as_ref();
    let receiver = robot.sensors.wireless_receiver.as_ref();
    Antenna {
        emits_within: transmitter.map(|transmitter| transmitter.range),
        receiver: receiver.map(|receiver| Receiver {
            n_sectors: receiver.n_sectors as usize,
            range: receiver.range,
            decay: Decay { rho: receiver.decay_rho, phi: receiver.decay_phi },
            max_hops: receiver.max_hops,
            sending_direction: receiver.sending_direction,
            observes_sending_direction,
        }),
    }
}

//! The world as compiled: what is the same for all its episodes.

use std::ops::Range;

use crate::communication::{Antenna, Quantiser, Receiver};
use crate::config::{
    ActuatorQuery, ObjectConfig, PerturbationsConfig, RobotConfig, RobotController, SensorQuery,
    SensorsConfig, WorldConfig,
};
use crate::initializers::{Headings, Positions};
use crate::network::Network;
use crate::problems::Problems;
use crate::torus::Torus;

/// A torus and what is in it.
#[derive(Debug, Clone)]
pub(crate) struct World {
    /// The plane.
    pub torus: Torus,
    /// Robots, object by object.
    pub groups: Vec<RobotGroup>,
    /// Antennas per robot.
    pub antennas: Vec<Antenna>,
    /// Components of a message; 0 without wireless link.
    pub message_len: usize,
    /// Index in `groups` of the robots that evolve and are judged.
    pub evolvable: usize,
}

/// The robots of one object of the world.
#[derive(Debug, Clone)]
pub(crate) struct RobotGroup {
    /// Name of the object.
    pub name: String,
    /// Index of the object.
    pub object: u64,
    /// Its robots.
    pub robots: Range<usize>,
    /// What it feeds to its controller.
    pub stimuli: Vec<(SensorQuery, Range<usize>)>,
    /// What quantises its messages, if anything does.
    pub quantiser: Option<Quantiser>,
    /// Where it starts.
    pub positions: Positions,
    /// Where it looks at first.
    pub headings: Headings,
    /// What goes wrong.
    pub perturbations: PerturbationsConfig,
}

impl World {
    /// Notes what cannot be simulated; none if that leaves no world.
    pub fn compile(
        config: &WorldConfig,
        evolvable_object: &str,
        network: &Network,
        problems: &mut Problems,
    ) -> Option<Self> {
        let mut world = Self {
            torus: Torus { width: config.width, height: config.height },
            groups: Vec::new(),
            antennas: Vec::new(),
            message_len: 0,
            evolvable: usize::MAX,
        };
        for (index, (name, object)) in config.objects.iter().enumerate() {
            let path = format!("world.objects.{name}");
            let ObjectConfig::Robot(robot) = object else {
                problems.add(path, "lights and ground areas are not supported");
                continue;
            };
            if name == evolvable_object {
                world.evolvable = world.groups.len();
            }
            let mut site = Site { path: &path, problems };
            world.set_message_len(robot, &mut site);
            if let Some(group) = world.group(name, index, robot, network, &mut site) {
                world.antennas.extend(group.robots.clone().map(|_| antenna(robot)));
                world.groups.push(group);
            }
        }
        if world.evolvable >= world.groups.len() {
            problems.add(
                "algorithm.evolvable_object",
                format!("world.objects has no robots named {evolvable_object:?}"),
            );
            return None;
        }
        Some(world)
    }

    /// Number of robots of all objects.
    pub fn n_robots(&self) -> usize {
        self.antennas.len()
    }

    /// All robots share one ether, so all messages have one length.
    fn set_message_len(&mut self, robot: &RobotConfig, site: &mut Site<'_>) {
        let receiver = robot.sensors.wireless_receiver.as_ref().map(|r| r.msg_length);
        let transmitter = robot.actuators.wireless_transmitter.as_ref().map(|t| t.msg_length);
        for len in [receiver, transmitter].into_iter().flatten() {
            let len = len as usize;
            if self.message_len != 0 && self.message_len != len {
                site.add("", "messages of receivers and transmitters differ in length");
            }
            self.message_len = len;
        }
    }

    fn group(
        &self,
        name: &str,
        index: usize,
        robot: &RobotConfig,
        network: &Network,
        site: &mut Site<'_>,
    ) -> Option<RobotGroup> {
        let n = robot.num_instances as usize;
        if robot.controller != RobotController::NeuralController {
            site.add(".controller", "not supported");
            return None;
        }
        check_supported(robot, site);
        check_outputs(robot, network, site);
        let stimuli = network.stimuli.iter().map(|(name, stimulus)| {
            match reading_len(stimulus.sensor, &robot.sensors) {
                None => site.add(".sensors", format!("stimulus {name:?} has no sensor")),
                Some(len) if len != stimulus.inputs.len() => {
                    let n = stimulus.inputs.len();
                    let message = format!("stimulus {name:?} has n = {n}, its sensor gives {len}");
                    site.add(".sensors", message);
                }
                Some(_) => {}
            }
            (stimulus.sensor, stimulus.inputs.clone())
        });
        let stimuli = stimuli.collect();
        let transmitter = robot.actuators.wireless_transmitter.as_ref();
        let quantiser = transmitter.filter(|transmitter| transmitter.quantize).and_then(|t| {
            let quantiser = Quantiser::new(t.msg_length as usize, t.n_symbols, t.beta);
            site.accept(".actuators.wireless_transmitter.n_symbols", quantiser)
        });
        let positions = Positions::new(&robot.initializers.positions, n);
        let positions = site.accept(".initializers.positions", positions);
        let headings = Headings::new(&robot.initializers.orientations, n);
        let headings = site.accept(".initializers.orientations", headings);
        Some(RobotGroup {
            name: name.to_owned(),
            object: index as u64,
            robots: self.n_robots()..self.n_robots() + n,
            stimuli,
            quantiser,
            positions: positions?,
            headings: headings?,
            perturbations: robot.perturbations.clone(),
        })
    }
}

/// An object of the world, as a place for problems.
struct Site<'a> {
    path: &'a str,
    problems: &'a mut Problems,
}

impl Site<'_> {
    fn add(&mut self, key: &str, message: impl Into<String>) {
        self.problems.add(format!("{}{key}", self.path), message);
    }

    fn accept<T>(&mut self, key: &str, result: Result<T, String>) -> Option<T> {
        result.map_err(|message| self.add(key, message)).ok()
    }
}

/// Notes what this simulator knows and does not simulate.
fn check_supported(robot: &RobotConfig, site: &mut Site<'_>) {
    let sensors = &robot.sensors;
    let perturbations = &robot.perturbations;
    for (present, key) in [
        (sensors.light_sensor.is_some(), ".sensors.light_sensor"),
        (sensors.distance_sensor.is_some(), ".sensors.distance_sensor"),
        (sensors.ground_sensor.is_some(), ".sensors.ground_sensor"),
        (robot.actuators.wheel_actuator.is_some(), ".actuators.wheel_actuator"),
        (perturbations.stimuli_inhibition.is_some(), ".perturbations.stimuli_inhibition"),
        (perturbations.topology_switch.is_some(), ".perturbations.topology_switch"),
        (perturbations.uncontrollable_rotation.is_some(), ".perturbations.uncontrollable_rotation"),
    ] {
        if present {
            site.add(key, "not supported");
        }
    }
}

/// Notes outputs whose actuators the robot lacks.
fn check_outputs(robot: &RobotConfig, network: &Network, site: &mut Site<'_>) {
    let actuators = &robot.actuators;
    for output in &network.outputs {
        let (mounted, key) = match output.actuator {
            ActuatorQuery::Wheels => (actuators.wheel_actuator.is_some(), "wheel_actuator"),
            ActuatorQuery::Led => (actuators.led_actuator.is_some(), "led_actuator"),
            ActuatorQuery::Message | ActuatorQuery::Mode => {
                (actuators.wireless_transmitter.is_some(), "wireless_transmitter")
            }
        };
        if !mounted {
            site.add(".actuators", format!("an output drives the {key}, which is not mounted"));
        }
        if let (ActuatorQuery::Message, Some(transmitter)) =
            (output.actuator, &actuators.wireless_transmitter)
            && transmitter.msg_length as usize != output.neurons.len()
        {
            let n = output.neurons.len();
            let message = format!("differs from the {n} neurons of the output that drives it");
            site.add(".actuators.wireless_transmitter.msg_length", message);
        }
    }
}

/// Number of values of a reading; none without its sensor.
fn reading_len(query: SensorQuery, sensors: &SensorsConfig) -> Option<usize> {
    let receiver = sensors.wireless_receiver.as_ref();
    match query {
        SensorQuery::ReceiverMessage => receiver.map(|receiver| receiver.msg_length as usize),
        SensorQuery::ReceiverSignal | SensorQuery::ReceiverState => receiver.map(|_| 1),
        SensorQuery::ReceiverReceivingDirection | SensorQuery::ReceiverSendingDirection => {
            receiver.map(|_| 2)
        }
        SensorQuery::Light => sensors.light_sensor.as_ref().map(|light| light.n_sectors as usize),
        SensorQuery::Distance => sensors.distance_sensor.as_ref().map(|d| d.n_sectors as usize),
        SensorQuery::Ground => sensors.ground_sensor.as_ref().map(|_| 1),
    }
}

fn antenna(robot: &RobotConfig) -> Antenna {
    Antenna {
        emits_within: robot.actuators.wireless_transmitter.as_ref().map(|t| t.range),
        receiver: robot.sensors.wireless_receiver.as_ref().map(|receiver| Receiver {
            n_sectors: receiver.n_sectors as usize,
            range: receiver.range,
            decay_rho: receiver.decay_rho,
            decay_phi: receiver.decay_phi,
            max_hops: receiver.max_hops,
        }),
    }
}

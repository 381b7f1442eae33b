//! The world as compiled: what is the same for all its episodes.

use std::ops::Range;

use crate::communication::{Antenna, Quantiser, Receiver};
use crate::drive::Drive;
use crate::initializers::{Headings, Positions};
use crate::network::Network;
use crate::problems::Problems;
use crate::sensors::{Decay, DistanceSensor, GroundSensor, LightSensor};
use crate::torus::Torus;
use experiment_file::{
    GroundAreaConfig, LightController, LightSourceConfig, ObjectConfig, PerturbationsConfig,
    RobotConfig, RobotController, SensorQuery, SensorsConfig, WorldConfig,
};

/// Communication range of robots without radio, cm.
const DEFAULT_RANGE: f64 = 100.0;

/// A torus and what is in it.
#[derive(Debug, Clone)]
pub(crate) struct World {
    /// The plane.
    pub torus: Torus,
    /// Robots, object by object.
    pub groups: Vec<RobotGroup>,
    /// Antennas per robot.
    pub antennas: Vec<Antenna>,
    /// Lights, object by object.
    pub lights: Vec<Fixtures>,
    /// How the lights of each object move.
    pub light_controllers: Vec<LightController>,
    /// Ground areas, object by object.
    pub areas: Vec<Fixtures>,
    /// Components of a message; 0 without radio.
    pub message_len: usize,
    /// Index in `groups` of the robots that evolve and are judged.
    pub evolvable: usize,
}

/// What an object's instances have in common.
#[derive(Debug, Clone)]
pub(crate) struct Site {
    /// Name of the object.
    pub name: String,
    /// Index of the object.
    pub object: usize,
    /// Where its instances start.
    pub positions: Positions,
}

/// The lights, or the ground areas, of one object.
#[derive(Debug, Clone)]
pub(crate) struct Fixtures {
    /// Where they come from.
    pub site: Site,
    /// Their numbers among all lights, or all ground areas.
    pub members: Range<usize>,
    /// Reach or radius, cm.
    range: f64,
    color: String,
}

/// The robots of one object.
#[derive(Debug, Clone)]
pub(crate) struct RobotGroup {
    /// Where they come from.
    pub site: Site,
    /// Where they look at first.
    pub headings: Headings,
    /// Their numbers among all robots.
    pub robots: Range<usize>,
    /// What decides their actions.
    pub controller: RobotController,
    /// What their controller gets, and in which of its inputs.
    pub stimuli: Vec<(SensorQuery, Range<usize>)>,
    /// Sensors beside the radio.
    pub light_sensor: Option<LightSensor>,
    /// Sensors beside the radio.
    pub distance_sensor: Option<DistanceSensor>,
    /// Sensors beside the radio.
    pub ground_sensor: Option<GroundSensor>,
    /// Wheels.
    pub drive: Option<Drive>,
    /// What quantises their messages.
    pub quantiser: Option<Quantiser>,
    /// What goes wrong.
    pub perturbations: PerturbationsConfig,
}

impl World {
    /// Compiles the objects, of which `evolvable_object` names the robots that are
    /// judged; none if there are no such robots.
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
            lights: Vec::new(),
            light_controllers: Vec::new(),
            areas: Vec::new(),
            message_len: 0,
            evolvable: 0,
        };
        // Sensors refer to lights and areas, which may come after their robots.
        for (index, (name, object)) in config.objects.iter().enumerate() {
            match object {
                ObjectConfig::Robot(_) => {}
                ObjectConfig::LightSource(light) => world.add_lights(index, name, light, problems),
                ObjectConfig::GroundArea(area) => world.add_areas(index, name, area, problems),
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

    /// The robots that evolve and are judged.
    pub fn judged(&self) -> Range<usize> {
        self.groups[self.evolvable].robots.clone()
    }

    /// Distance within which two of the judged robots hear each other, cm.
    pub fn communication_range(&self) -> f64 {
        let antenna = self.judged().next().map(|robot| self.antennas[robot]).unwrap_or_default();
        match (antenna.emits_within, antenna.receiver) {
            (Some(reach), Some(receiver)) => receiver.range.min(reach),
            _ => DEFAULT_RANGE,
        }
    }

    /// Distance beyond which no robot senses another one, cm.
    pub fn sensing_range(&self) -> f64 {
        let receivers = self.antennas.iter().filter_map(|antenna| antenna.receiver);
        let sensors = self.groups.iter().filter_map(|group| group.distance_sensor.as_ref());
        let ranges = receivers.map(|receiver| receiver.range);
        ranges.chain(sensors.map(|sensor| sensor.range)).fold(0.0, f64::max)
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
        let Some(site) = site(index, name, positions, problems) else { return };
        let members = self.n_lights()..self.n_lights() + n;
        let (range, color) = (config.params.range, config.params.color.clone());
        self.lights.push(Fixtures { site, members, range, color });
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
        let Some(site) = site(index, name, positions, problems) else { return };
        let members = self.n_areas()..self.n_areas() + n;
        let (range, color) = (config.params.range, config.params.color.clone());
        self.areas.push(Fixtures { site, members, range, color });
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
        let site = site(index, name, positions, problems);
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
        let sensors = &config.sensors;
        let light_sensor = self.light_sensor(sensors);
        let stimuli = match config.controller {
            RobotController::NeuralController => {
                let stimuli = network.stimuli.values();
                stimuli.map(|stimulus| (stimulus.sensor, stimulus.inputs.clone())).collect()
            }
            RobotController::BraitenbergLightFollower => {
                let n_sectors = light_sensor.as_ref().map_or(0, |sensor| sensor.n_sectors);
                vec![(SensorQuery::Light, 0..n_sectors)]
            }
        };
        let group = RobotGroup {
            site,
            headings,
            robots: self.n_robots()..self.n_robots() + n,
            controller: config.controller,
            stimuli,
            light_sensor,
            distance_sensor: sensors.distance_sensor.as_ref().map(|sensor| DistanceSensor {
                n_sectors: sensor.n_sectors as usize,
                range: sensor.range,
                decay: Decay { rho: sensor.decay_rho, phi: sensor.decay_phi },
                noise_deviation: sensor.noise_variance.sqrt(),
            }),
            ground_sensor: sensors.ground_sensor.as_ref().map(|sensor| GroundSensor {
                areas: of_color(&self.areas, &sensor.color).collect(),
            }),
            drive: config.actuators.wheel_actuator.as_ref().map(|wheels| Drive {
                max_speed: wheels.max_speed,
                axle_length: wheels.axle_length,
                step_duration: wheels.step_duration,
            }),
            quantiser: transmitter
                .filter(|transmitter| transmitter.quantize)
                .map(|t| Quantiser::new(t.msg_length as usize, t.n_levels() as usize, t.beta)),
            perturbations: config.perturbations.clone(),
        };
        self.antennas.extend(group.robots.clone().map(|_| antenna(config)));
        self.groups.push(group);
    }

    fn light_sensor(&self, sensors: &SensorsConfig) -> Option<LightSensor> {
        let sensor = sensors.light_sensor.as_ref()?;
        let lights = of_color(&self.lights, &sensor.color);
        Some(LightSensor {
            n_sectors: sensor.n_sectors as usize,
            decay: Decay { rho: sensor.decay_rho, phi: sensor.decay_phi },
            noise_deviation: sensor.noise_variance.sqrt(),
            lights: lights.map(|(light, range)| (light, range.min(sensor.range))).collect(),
        })
    }
}

fn site(
    index: usize,
    name: &str,
    positions: Result<Positions, String>,
    problems: &mut Problems,
) -> Option<Site> {
    match positions {
        Ok(positions) => Some(Site { name: name.to_owned(), object: index, positions }),
        Err(message) => {
            problems.add(format!("world.objects.{name}.initializers.positions"), message);
            None
        }
    }
}

/// Numbers and ranges of the fixtures of a colour.
fn of_color(fixtures: &[Fixtures], color: &str) -> impl Iterator<Item = (usize, f64)> {
    let fixtures = fixtures.iter().filter(move |fixtures| fixtures.color == color);
    fixtures.flat_map(|fixtures| fixtures.members.clone().map(|member| (member, fixtures.range)))
}

fn antenna(robot: &RobotConfig) -> Antenna {
    let transmitter = robot.actuators.wireless_transmitter.as_ref();
    let receiver = robot.sensors.wireless_receiver.as_ref();
    Antenna {
        emits_within: transmitter.map(|transmitter| transmitter.range),
        receiver: receiver.map(|receiver| Receiver {
            n_sectors: receiver.n_sectors as usize,
            range: receiver.range,
            decay: Decay { rho: receiver.decay_rho, phi: receiver.decay_phi },
            max_hops: receiver.max_hops,
        }),
    }
}

//! Platforms: what is known of real robots, as defaults of the keys of a robot.

use serde_json::{Value, json};

use crate::DefaultValue::{self, Number, Numbers, Whole};
use crate::ParameterValue;

/// A kind of real robot.
#[derive(Debug)]
pub struct Platform {
    /// Its name in files.
    pub name: &'static str,
    /// What is known of it.
    pub facts: &'static [Fact],
    /// Keys of a robot for which no source is known, so that they keep their usual defaults.
    pub unknown: &'static [&'static str],
}

/// A number of a real robot.
#[derive(Debug)]
pub struct Fact {
    /// The key of a robot whose default it is.
    pub key: &'static str,
    /// The default.
    pub value: DefaultValue,
    /// Who says so, in Markdown.
    pub source: &'static str,
}

const fn fact(key: &'static str, value: DefaultValue, source: &'static str) -> Fact {
    Fact { key, value, source }
}

const RADIUS: &str = "body.radius";
const MASS: &str = "body.mass";
const PUSH_FORCE: &str = "body.push_force";
const MAX_SPEED: &str = "actuators.wheel_actuator.max_speed";
const AXLE_LENGTH: &str = "actuators.wheel_actuator.axle_length";
const EMITTER_RANGE: &str = "actuators.wireless_transmitter.range";
const RECEIVER_SECTORS: &str = "sensors.wireless_receiver.n_sectors";
const RECEIVER_RANGE: &str = "sensors.wireless_receiver.range";
const RECEIVER_DECAY: &str = "sensors.wireless_receiver.decay_phi";
const DISTANCE_SECTORS: &str = "sensors.distance_sensor.n_sectors";
const DISTANCE_RANGE: &str = "sensors.distance_sensor.range";
const DISTANCE_DECAY: &str = "sensors.distance_sensor.decay_phi";
const LIGHT_SECTORS: &str = "sensors.light_sensor.n_sectors";
const N_RAYS: &str = "sensors.proximity_sensor.n_rays";
const RAY_RANGE: &str = "sensors.proximity_sensor.range";
const RAY_ANGLES: &str = "sensors.proximity_sensor.angles";
const RAY_NOISE: &str = "sensors.proximity_sensor.noise_sigma";
const LIGHT_NOISE: &str = "sensors.light_sensor.noise_variance";
const DISTANCE_NOISE: &str = "sensors.distance_sensor.noise_variance";

const GCTRONIC: &str = "[GCtronic](https://www.gctronic.com/doc/index.php/e-puck2)";
const WEBOTS_EPUCK: &str = "[Webots](https://cyberbotics.com/doc/guide/epuck)";
const ARGOS_EPUCK: &str = "[ARGoS](https://github.com/ilpincy/argos3)'s e-puck";
const ARGOS_KHEPERA: &str = "[ARGoS](https://github.com/ilpincy/argos3-kheperaiv)'s Khepera IV";
const K_TEAM: &str = "[K-Team](https://www.k-team.com/khepera-iv)";
const SOARES: &str = "[Soares 2015](https://doi.org/10.1007/978-3-319-27146-0_59)";
const RUBENSTEIN: &str = "[Rubenstein 2012](https://doi.org/10.1109/ICRA.2012.6224638)";
const BEARING: &str = "[Rubenstein 2012](https://doi.org/10.1109/ICRA.2012.6224638): robots sense \
                       distances, and no directions";
const ARGOS_KILOBOT: &str = "[ARGoS](https://github.com/ilpincy/argos3-kilobot)'s Kilobot";
const LOI: &str = "[Loi 2025](https://arxiv.org/abs/2504.08686): 6 cm in diameter";
const POGOSIM: &str = "[Pogosim](https://github.com/Adacoma/pogosim), `conf/test.yaml`";
const POGOSIM_RANGE: &str = "[Pogosim](https://github.com/Adacoma/pogosim), `conf/test.yaml`: \
                             from an emitter";
const POGOSIM_ARRAY: &str = "[Pogosim](https://github.com/Adacoma/pogosim), `conf/test.yaml`: \
                             front, left, back, right";

/// All platforms.
pub const PLATFORMS: &[Platform] = &[
    Platform {
        name: "e-puck2",
        facts: &[
            fact(RADIUS, Number(3.5), ARGOS_EPUCK),
            fact(MASS, Number(0.13), WEBOTS_EPUCK),
            fact(MAX_SPEED, Number(15.4), GCTRONIC),
            fact(AXLE_LENGTH, Number(5.3), ARGOS_EPUCK),
            fact(LIGHT_SECTORS, Whole(8), WEBOTS_EPUCK),
            fact(N_RAYS, Whole(8), WEBOTS_EPUCK),
            fact(
                RAY_ANGLES,
                Numbers(&[-0.3, -0.8, -1.57, -2.64, 2.64, 1.57, 0.8, 0.3]),
                "[Webots](https://cyberbotics.com/doc/guide/epuck), from `ps0` to `ps7`",
            ),
            fact(RAY_RANGE, Number(6.0), GCTRONIC),
        ],
        unknown: &[PUSH_FORCE, RAY_NOISE, LIGHT_NOISE],
    },
    Platform {
        name: "khepera4",
        facts: &[
            fact(RADIUS, Number(7.04), ARGOS_KHEPERA),
            fact(MASS, Number(0.54), K_TEAM),
            fact(MAX_SPEED, Number(81.4), SOARES),
            fact(AXLE_LENGTH, Number(10.54), ARGOS_KHEPERA),
            fact(LIGHT_SECTORS, Whole(8), K_TEAM),
            fact(N_RAYS, Whole(8), ARGOS_KHEPERA),
            fact(RAY_RANGE, Number(12.0), ARGOS_KHEPERA),
        ],
        unknown: &[PUSH_FORCE, RAY_NOISE, LIGHT_NOISE],
    },
    Platform {
        name: "kilobot",
        facts: &[
            fact(RADIUS, Number(1.65), RUBENSTEIN),
            fact(MASS, Number(0.01), ARGOS_KILOBOT),
            fact(MAX_SPEED, Number(1.0), RUBENSTEIN),
            fact(
                AXLE_LENGTH,
                Number(2.5),
                "[ARGoS](https://github.com/ilpincy/argos3-kilobot)'s Kilobot: between the legs",
            ),
            fact(EMITTER_RANGE, Number(7.0), RUBENSTEIN),
            fact(RECEIVER_SECTORS, Whole(1), BEARING),
            fact(RECEIVER_RANGE, Number(7.0), RUBENSTEIN),
            fact(RECEIVER_DECAY, Number(0.0), BEARING),
            fact(DISTANCE_SECTORS, Whole(1), BEARING),
            fact(DISTANCE_RANGE, Number(7.0), RUBENSTEIN),
            fact(DISTANCE_DECAY, Number(0.0), BEARING),
            fact(LIGHT_SECTORS, Whole(1), RUBENSTEIN),
        ],
        unknown: &[PUSH_FORCE, DISTANCE_NOISE, LIGHT_NOISE],
    },
    Platform {
        name: "pogobot",
        facts: &[
            fact(RADIUS, Number(3.0), LOI),
            fact(MAX_SPEED, Number(10.0), POGOSIM),
            fact(EMITTER_RANGE, Number(8.0), POGOSIM_RANGE),
            fact(RECEIVER_SECTORS, Whole(4), POGOSIM_ARRAY),
            fact(RECEIVER_RANGE, Number(8.0), POGOSIM_RANGE),
        ],
        unknown: &[MASS, PUSH_FORCE, AXLE_LENGTH],
    },
];

impl Platform {
    /// The names of all platforms.
    pub(crate) const NAMES: &[&str] = &names();

    pub(crate) fn find(name: &str) -> Option<&'static Self> {
        PLATFORMS.iter().find(|platform| platform.name == name)
    }

    /// The facts as defaults of a robot's keys.
    pub(crate) fn defaults(&self) -> Vec<(&'static str, ParameterValue)> {
        self.facts.iter().filter_map(|fact| Some((fact.key, fact.value.value()?))).collect()
    }
}

const fn names() -> [&'static str; PLATFORMS.len()] {
    let mut names = [""; PLATFORMS.len()];
    let mut index = 0;
    while index < names.len() {
        names[index] = PLATFORMS[index].name;
        index += 1;
    }
    names
}

/// The schema of the key that names a platform.
pub(crate) fn schema() -> Value {
    json!({
        "enum": Platform::NAMES,
        "description": "The real robot whose numbers are the defaults of `body`, `sensors` and \
                        `actuators`.",
    })
}

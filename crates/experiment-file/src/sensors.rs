//! The sensors of robots. [`sensors!`] below has one row per kind of sensor. The key in files, the
//! readings that stimuli may name, their checks and the budget follow from the row. `parameters!`
//! then declares the parameters of each kind. For each row except the radio's, `sim-core` has a
//! function of that name, which makes the sensor that computes the reading.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::DefaultValue::{Name, Null, Number, Required, Whole};
use crate::parameters::{Also, parameters, variants};
use crate::{BlockedBy, Domain, SEES, Sees, limits};

/// Sensors of SpikeSwarmSim that this simulator lacks.
pub(crate) const UNSUPPORTED: [&str; 1] = ["neighbors_state_sensor"];

/// Readings that are refused by name.
pub(crate) const UNSUPPORTED_READINGS: &[&str] = &[
    "neighbors_state_sensor",
    "wireless_receiver",
    "wireless_receiver:am_i_sender",
    "wireless_receiver:am_i_targeted",
    "wireless_receiver:destination",
    "wireless_receiver:n_hops",
    "wireless_receiver:priority",
    "wireless_receiver:sender",
];

/// Declares the sensors, from one row per kind: its key in `sensors`; the type of its parameters;
/// how often it looks at every robot and light, by which the budget multiplies their number; and
/// its readings, each with its name in files and its length. `$dollar` is `$`, for the macro that
/// this one makes.
macro_rules! sensors {
    ($dollar:tt $(
        $(#[doc = $sensor_doc:literal])*
        $key:ident: $config:ident, seen: $n_seen:expr, {
            $(
                $(#[doc = $reading_doc:literal])*
                $name:literal = $query:ident: $len:expr,
            )*
        }
    )*) => {
        parameters! {
            /// Sensors; absent ones are not mounted.
            pub struct SensorsConfig: Default {
                $(
                    $(#[doc = $sensor_doc])*
                    $key: Option<$config> = optional($config::OBJECT),
                )*
            }
        }

        /// A reading of a robot, by the name that config files use.
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
        )]
        pub enum SensorQuery {
            $($(
                $(#[doc = $reading_doc])*
                #[serde(rename = $name)]
                $query,
            )*)*
        }

        impl SensorsConfig {
            /// Number of values of a reading; `None` if its sensor is not mounted.
            pub fn reading_len(&self, reading: SensorQuery) -> Option<u32> {
                match reading {
                    $($(
                        SensorQuery::$query => {
                            let len: fn(&$config) -> u32 = $len;
                            self.$key.as_ref().map(len)
                        }
                    )*)*
                }
            }

            /// How often all mounted sensors look at every robot and light.
            pub(crate) fn n_seen(&self) -> u32 {
                let mut n_seen = 0;
                $(
                    let seen: fn(&$config) -> u32 = $n_seen;
                    n_seen += self.$key.as_ref().map_or(0, seen);
                )*
                n_seen
            }
        }

        /// Calls a macro with every sensor: its key, and its readings as variants of
        /// [`SensorQuery`].
        #[macro_export]
        macro_rules! for_each_sensor {
            ($dollar each:ident) => {
                $($dollar each!($key: $($query)*);)*
            };
        }

        impl SensorQuery {
            /// All readings.
            pub const ALL: &[Self] = &[$($(Self::$query,)*)*];

            /// Its name in the file.
            pub fn name(self) -> &'static str {
                match self {
                    $($(Self::$query => $name,)*)*
                }
            }

            /// Key in `sensors` of the sensor that gives the reading.
            pub(crate) fn sensor_key(self) -> &'static str {
                match self {
                    $($(Self::$query => stringify!($key),)*)*
                }
            }
        }
    };
}

sensors! { $
    /// Frames of other robots.
    wireless_receiver: WirelessReceiverConfig, seen: |sensor| sensor.n_sectors, {
        /// Message of the chosen frame; `msg_length` values.
        "wireless_receiver:msg" = ReceiverMessage: |receiver| receiver.msg_length,
        /// Strength of the chosen frame; 1 value.
        "wireless_receiver:signal" = ReceiverSignal: |_| 1,
        /// (cos, sin) of the sector that received it; 2 values.
        "wireless_receiver:receiving_direction" = ReceiverReceivingDirection: |_| 2,
        /// (cos, sin) of the emitter's sector that faced the receiver; 2 values.
        "wireless_receiver:sending_direction" = ReceiverSendingDirection: |_| 2,
        /// Own communication mode, 1 send, 0 relay; 1 value.
        "wireless_receiver:state" = ReceiverState: |_| 1,
    }
    /// Lights.
    light_sensor: LightSensorConfig, seen: |sensor| sensor.n_sectors, {
        /// Light per sector; `n_sectors` values.
        "light_sensor" = Light: |sensor| sensor.n_sectors,
    }
    /// Other robots.
    distance_sensor: DistanceSensorConfig, seen: |sensor| sensor.n_sectors, {
        /// Nearness of other robots per sector; `n_sectors` values.
        "distance_sensor" = Distance: |sensor| sensor.n_sectors,
    }
    /// Ground areas.
    ground_sensor: GroundSensorConfig, seen: |_| 0, {
        /// 1 on a ground area of the sensor's colour; 1 value.
        "ground_sensor" = Ground: |_| 1,
    }
    /// Whether the robot stands on a `food_area`, which is a green ground area.
    food_area_sensor: PlainSensorConfig, seen: |_| 0, {
        /// 1 on a food area; 1 value.
        "food_area_sensor" = FoodArea: |_| 1,
    }
    /// Whether the robot stands on a `nest`, which is a black ground area.
    nest_sensor: PlainSensorConfig, seen: |_| 0, {
        /// 1 on a nest; 1 value.
        "nest_sensor" = Nest: |_| 1,
    }
    /// Whether the robot carries something, which the function `react` of a script decides.
    food_sensor: PlainSensorConfig, seen: |_| 0, {
        /// 1 while the robot carries something; 1 value.
        "food_sensor" = Food: |_| 1,
    }
    /// Position of the robot.
    own_position_sensor: PlainSensorConfig, seen: |_| 0, {
        /// x and y, cm; 2 values.
        "own_position_sensor" = OwnPosition: |_| 2,
    }
    /// Heading of the robot.
    own_orientation_sensor: PlainSensorConfig, seen: |_| 0, {
        /// Heading, in turns from 0 to 1; 1 value.
        "own_orientation_sensor" = OwnOrientation: |_| 1,
    }
    /// Positions and headings of the nearest robots.
    neighborhood_pos_sensor: NeighborhoodSensorConfig, seen: |sensor| sensor.n_neighbors, {
        /// x and y, cm, and heading, radians, of the nearest robots; 3 `n_neighbors` values.
        "neighborhood_pos_sensor" = NeighborhoodPos: |sensor| 3 * sensor.n_neighbors,
    }
    /// Numbers that the function `sense` of a script returns.
    // A script may look at everything for each of its numbers.
    script_sensor: ScriptSensorConfig, seen: |sensor| sensor.n, {
        /// The numbers that the function `sense` of the script returns; `n` values.
        "script_sensor" = Script: |sensor| sensor.n,
    }
    /// How near the robot's body is to others, along rays.
    proximity_sensor: ProximitySensorConfig, seen: |sensor| sensor.n_rays, {
        /// Nearness of what each ray meets; `n_rays` values.
        "proximity_sensor" = Proximity: |sensor| sensor.n_rays,
    }
    /// Whether the robot's body touches something.
    contact_sensor: ContactSensorConfig, seen: |_| 0, {
        /// 1 per sector in which the body touches something; `n_sectors` values.
        "contact_sensor" = Contact: |sensor| sensor.n_sectors,
    }
}

/// Range of the number of sectors, and of other numbers of values.
const SECTORS: [u32; 2] = [1, limits::SECTORS];

/// SpikeSwarmSim states the standard deviation of noise.
const NOISE_SIGMA: Also = Also {
    key: "noise_sigma",
    max: 31_622.776_601_683_792,
    meaning: "Standard deviation of the noise; its square is `noise_variance`.",
    value: |sigma| sigma * sigma,
};

parameters! {
    /// Receiver of the wireless link (section 3.3 of the thesis).
    pub struct WirelessReceiverConfig: Default {
        /// Number of sectors around the robot.
        n_sectors: u32 = whole(SECTORS, 4).original(Whole(2)),
        /// Reach, cm.
        range: f64 = positive(100.0),
        /// Components of a message, M.
        msg_length: u32 = whole([1, limits::MESSAGE_LENGTH], 2),
        /// Number of hops from which on the receiver ignores a frame.
        max_hops: u32 = whole([1, limits::HOPS], 10),
        /// Decay of a frame's strength with the distance, per cm.
        decay_rho: f64 = amount(0.05).original(Number(0.005)),
        /// Decay of a frame's strength with the angle, per radian.
        decay_phi: f64 = amount(1.0),
        /// The robot whose sector is the sending direction.
        sending_direction: SendingDirection =
            of(Domain::Variant(SendingDirection::VARIANTS), Name("emitter"))
            .original(Name("originator"))
            .recent(),
        /// What stops frames on their way to the receiver.
        blocked_by: BlockedBy =
            of(Domain::Variant(BlockedBy::VARIANTS), Name("nothing")).recent(),
    }
    ignored { "noise_sigma": "reception has no noise"; }

    /// Sees lights of one colour. A sector sums exp(-decay_rho distance - decay_phi angle) over
    /// them, with the angle between the light and the sector's direction.
    pub struct LightSensorConfig: Default {
        /// Number of sectors around the robot.
        n_sectors: u32 = whole(SECTORS, 6).original(Whole(2)),
        /// Reach, cm. The range of the light limits it, too.
        range: f64 = positive(80.0).original(Number(100.0)),
        /// Colour that the sensor sees.
        color: String = text("red"),
        /// Decay with the distance, per cm.
        decay_rho: f64 = amount(0.05).original(Number(0.005)),
        /// Decay with the angle, per radian.
        decay_phi: f64 = amount(1.0),
        /// Variance of the Gaussian noise.
        noise_variance: f64 = amount(0.1).original(Number(0.0)).also(NOISE_SIGMA),
        /// Largest angle between a sector's direction and an object that it sees, radians.
        aperture: f64 = between([1.0 / limits::MAGNITUDE, PI], PI)
            .shown("pi: every sector sees everything")
            .original_from(|params| {
                (3.0 * PI / f64::from(params.of_key::<u32>("n_sectors"))).min(PI)
            })
            .recent(),
        /// What stops light on its way to the sensor.
        blocked_by: BlockedBy =
            of(Domain::Variant(BlockedBy::VARIANTS), Name("nothing")).recent(),
    }

    /// Sees other robots. The value of a sector is the largest exp(-decay_rho distance - decay_phi
    /// angle) of them, with the angle between the robot and the sector's direction.
    pub struct DistanceSensorConfig: Default {
        /// Number of sectors around the robot.
        n_sectors: u32 = whole(SECTORS, 4).original(Whole(2)),
        /// Reach, cm.
        range: f64 = positive(60.0).original(Number(100.0)),
        /// Decay with the distance, per cm.
        decay_rho: f64 = amount(0.05).original(Number(0.005)),
        /// Decay with the angle, per radian.
        decay_phi: f64 = amount(1.0),
        /// Variance of the Gaussian noise.
        noise_variance: f64 = amount(0.1).original(Number(0.0)).also(NOISE_SIGMA),
        /// Largest angle between a sector's direction and an object that it sees, radians.
        aperture: f64 = between([1.0 / limits::MAGNITUDE, PI], PI)
            .shown("pi: every sector sees everything")
            .original_from(|params| PI / f64::from(params.of_key::<u32>("n_sectors")))
            .recent(),
        /// What hides another robot from the sensor.
        blocked_by: BlockedBy =
            of(Domain::Variant(BlockedBy::VARIANTS), Name("nothing")).recent(),
    }

    /// Sees whether the robot stands on a ground area of one colour.
    pub struct GroundSensorConfig: Default {
        /// Colour that the sensor sees.
        color: String = text("black"),
    }

    /// A sensor without parameters.
    pub struct PlainSensorConfig: Default {}
    ignored { "range", "noise_sigma": "such a sensor has neither reach nor noise"; }

    /// Absolute positions and headings of the nearest robots.
    pub struct NeighborhoodSensorConfig: Default {
        /// Robots in a reading, the nearest first.
        n_neighbors: u32 = whole(SECTORS, 1),
    }
    ignored { "range", "noise_sigma": "the sensor knows all robots, without noise"; }

    /// Numbers that the function `sense` of the script of `task` returns for a robot.
    pub struct ScriptSensorConfig {
        /// Numbers that the function returns.
        n: u32 = of(Domain::Whole(1, limits::SECTORS), Required),
        /// Smaller numbers become this one.
        low: f64 = quantity(0.0),
        /// Larger numbers become this one.
        high: f64 = quantity(1.0),
    }

    /// Sees along rays from the robot's rim what its body may run into. A ray reads 1 - distance /
    /// range of the first thing that it meets, and 0 if there is none within the range.
    pub struct ProximitySensorConfig: Default {
        /// Number of rays.
        n_rays: u32 = whole(SECTORS, 8),
        /// Reach from the robot's rim, cm.
        range: f64 = positive(10.0),
        /// Angle of each ray to the robot's heading, radians.
        angles: Option<Vec<f64>> = of(Domain::Numbers(1, limits::SECTORS as usize), Null)
            .null()
            .shown("null: evenly around the robot, the first one ahead"),
        /// What the rays meet: `robots`; `walls`, with the boundary; `objects`, which are obstacles
        /// and movables; a list of these; or `all`.
        sees: Sees = of(Domain::Variant(SEES), Name("all")),
        /// Standard deviation of the Gaussian noise.
        noise_sigma: f64 = amount(0.0),
    }

    /// Feels what the robot's body touches.
    pub struct ContactSensorConfig: Default {
        /// Number of sectors around the robot.
        n_sectors: u32 = whole(SECTORS, 4),
    }
}

/// Whose sector `wireless_receiver:sending_direction` reads. The two variants differ for relayed
/// frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SendingDirection {
    /// The robot that the listener hears: the sector that faces the listener (section 3.3.2).
    Emitter,
    /// The robot that sent the message first: the sector that faced the first robot to hear it.
    Originator,
}

variants! {
    SendingDirection, unsupported: &[];
    SensorQuery, unsupported: UNSUPPORTED_READINGS;
}

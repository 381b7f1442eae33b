//! The sensors of robots: one row per kind of sensor in [`sensors!`] below, from
//! which the types, the reader, the schema, the readings that stimuli may name,
//! their checks and the budget follow. The parameters of each have a file of
//! their own; what they sense is `sim-core`'s `sensors`.

mod distance;
mod ground;
mod light;
mod neighborhood;
mod plain;
mod receiver;
mod script;

pub use distance::DistanceSensorConfig;
pub use ground::GroundSensorConfig;
pub use light::LightSensorConfig;
pub use neighborhood::NeighborhoodSensorConfig;
pub use plain::PlainSensorConfig;
pub use receiver::{SendingDirection, WirelessReceiverConfig};
pub use script::ScriptSensorConfig;

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::limits::POSITIVE;
use crate::node::{Node, Object};
use crate::semantics::Semantics;
use crate::{limits, schema};

/// What is asked of the parameters of a kind of sensor.
trait SensorConfig: Sized {
    /// Reads the parameters; those that the file leaves out have their defaults.
    fn read(o: &mut Object<'_>, semantics: Semantics) -> Self;

    /// Sectors in which every other robot and every light may be: what a robot's
    /// sensor costs per step, for the budget of an episode.
    fn n_sectors(&self) -> u32 {
        0
    }
}

/// Sensors of the original simulator that this one lacks.
pub(crate) const UNSUPPORTED: [&str; 1] = ["neighbors_state_sensor"];

/// Readings that are refused by name, beside those of [`UNSUPPORTED`] sensors.
pub(crate) const UNSUPPORTED_READINGS: [&str; 7] = [
    "wireless_receiver",
    "wireless_receiver:am_i_sender",
    "wireless_receiver:am_i_targeted",
    "wireless_receiver:destination",
    "wireless_receiver:n_hops",
    "wireless_receiver:priority",
    "wireless_receiver:sender",
];

/// From a row per kind of sensor: its key in `sensors` and the type of its
/// parameters, then its readings, each with its name in the file and its length.
macro_rules! sensors {
    ($(
        $(#[doc = $sensor_doc:literal])*
        $key:ident: $config:ident {
            $(
                $(#[doc = $reading_doc:literal])*
                $name:literal = $query:ident: $len:expr,
            )*
        }
    )*) => {
        /// Sensors; absent ones are not mounted.
        #[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
        #[schemars(default, deny_unknown_fields, transform = schema::without_null)]
        pub struct SensorsConfig {
            $(
                $(#[doc = $sensor_doc])*
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $key: Option<$config>,
            )*
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
            /// Number of values of a reading; none if its sensor is not mounted.
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

            /// Sectors of all mounted sensors.
            pub(crate) fn n_sectors(&self) -> u32 {
                let mut n_sectors = 0;
                $(n_sectors += self.$key.as_ref().map_or(0, SensorConfig::n_sectors);)*
                n_sectors
            }

            pub(crate) fn read(o: &mut Object<'_>, semantics: Semantics) -> Self {
                o.unsupported(&UNSUPPORTED);
                $(
                    let $key = o.optional(stringify!($key));
                    let $key = $key.map(|node| {
                        node.object(|o| SensorConfig::read(o, semantics))
                    });
                )*
                Self { $($key),* }
            }
        }

        impl SensorQuery {
            /// All of them.
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

sensors! {
    /// Frames of other robots.
    wireless_receiver: WirelessReceiverConfig {
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
    light_sensor: LightSensorConfig {
        /// Light per sector; `n_sectors` values.
        "light_sensor" = Light: |sensor| sensor.n_sectors,
    }
    /// Other robots.
    distance_sensor: DistanceSensorConfig {
        /// Nearness of other robots per sector; `n_sectors` values.
        "distance_sensor" = Distance: |sensor| sensor.n_sectors,
    }
    /// Ground areas.
    ground_sensor: GroundSensorConfig {
        /// 1 on a ground area of the sensor's colour; 1 value.
        "ground_sensor" = Ground: |_| 1,
    }
    /// Whether the robot stands on a `food_area`, which is a green ground area.
    food_area_sensor: PlainSensorConfig {
        /// 1 on a food area; 1 value.
        "food_area_sensor" = FoodArea: |_| 1,
    }
    /// Whether the robot stands on a `nest`, which is a black ground area.
    nest_sensor: PlainSensorConfig {
        /// 1 on a nest; 1 value.
        "nest_sensor" = Nest: |_| 1,
    }
    /// Whether the robot carries something, as the function `react` of a script says.
    food_sensor: PlainSensorConfig {
        /// 1 while the robot carries something; 1 value.
        "food_sensor" = Food: |_| 1,
    }
    /// Where the robot is.
    own_position_sensor: PlainSensorConfig {
        /// x and y, cm; 2 values.
        "own_position_sensor" = OwnPosition: |_| 2,
    }
    /// Where the robot looks.
    own_orientation_sensor: PlainSensorConfig {
        /// Heading, in turns from 0 to 1; 1 value.
        "own_orientation_sensor" = OwnOrientation: |_| 1,
    }
    /// Where the nearest robots are and look.
    neighborhood_pos_sensor: NeighborhoodSensorConfig {
        /// x and y, cm, and heading, radians, of the nearest robots; 3 `n_neighbors` values.
        "neighborhood_pos_sensor" = NeighborhoodPos: |sensor| 3 * sensor.n_neighbors,
    }
    /// What the function `sense` of a script says.
    script_sensor: ScriptSensorConfig {
        /// The numbers that the function `sense` of the script returns; `n` values.
        "script_sensor" = Script: |sensor| sensor.n,
    }
}

/// The variance of a sensor's noise, as `noise_variance`, or as `noise_sigma`: the
/// original states the standard deviation.
fn noise_variance(o: &mut Object<'_>, default: f64) -> f64 {
    let sigma = o.optional("noise_sigma");
    let variance = o.optional("noise_variance");
    if let (Some(sigma), Some(_)) = (&sigma, &variance) {
        sigma.problem("`noise_variance` says the same");
    }
    let from_sigma = |node: Node<'_>| {
        let sigma = node.number(0.0..=limits::MAGNITUDE.sqrt());
        sigma * sigma
    };
    variance.map(Node::amount).or_else(|| sigma.map(from_sigma)).unwrap_or(default)
}

/// Whether the canonical form leaves an aperture out: every sector sees everything.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_all_around(aperture: &f64) -> bool {
    *aperture == PI
}

fn aperture(node: Node<'_>) -> f64 {
    node.number(*POSITIVE.start()..=PI)
}

fn sectors(node: Node<'_>) -> u32 {
    node.u32(1..=limits::SECTORS)
}

//! What robots carry: sensors and actuators.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::json;

use super::{ActuatorQuery, SensorQuery, limits, schema};

/// Sensors; absent ones are not mounted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct SensorsConfig {
    /// Frames of other robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WirelessReceiverConfig")]
    pub wireless_receiver: Option<WirelessReceiverConfig>,
    /// Lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LightSensorConfig")]
    pub light_sensor: Option<LightSensorConfig>,
    /// Other robots.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "DistanceSensorConfig")]
    pub distance_sensor: Option<DistanceSensorConfig>,
    /// Ground areas.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "GroundSensorConfig")]
    pub ground_sensor: Option<GroundSensorConfig>,
}

impl SensorsConfig {
    /// Number of values of a reading; none if its sensor is not mounted.
    pub fn reading_len(&self, reading: SensorQuery) -> Option<u32> {
        let receiver = self.wireless_receiver.as_ref();
        match reading {
            SensorQuery::ReceiverMessage => receiver.map(|receiver| receiver.msg_length),
            SensorQuery::ReceiverSignal | SensorQuery::ReceiverState => receiver.map(|_| 1),
            SensorQuery::ReceiverReceivingDirection | SensorQuery::ReceiverSendingDirection => {
                receiver.map(|_| 2)
            }
            SensorQuery::Light => self.light_sensor.as_ref().map(|sensor| sensor.n_sectors),
            SensorQuery::Distance => self.distance_sensor.as_ref().map(|sensor| sensor.n_sectors),
            SensorQuery::Ground => self.ground_sensor.as_ref().map(|_| 1),
        }
    }
}

/// Receiver of the wireless link (section 3.3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("noise_sigma"))]
pub struct WirelessReceiverConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 100.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Components of a message, M; default 2.
    #[schemars(range(min = 1, max = limits::MESSAGE_LENGTH))]
    pub msg_length: u32,
    /// A frame of this many hops is not accepted any more; default 10.
    #[schemars(range(min = 1, max = limits::HOPS))]
    pub max_hops: u32,
    /// Decay of the strength per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay of the strength per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
}

impl Default for WirelessReceiverConfig {
    fn default() -> Self {
        Self {
            n_sectors: 4,
            range: 100.0,
            msg_length: 2,
            max_hops: 10,
            decay_rho: 0.05,
            decay_phi: 1.0,
        }
    }
}

/// Light sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("noise_sigma", schema::amount("Its square is `noise_variance`."))
)]
pub struct LightSensorConfig {
    /// Sectors; default 6.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 80. The light's own range bounds it too.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Colour it sees; default "red".
    pub color: String,
    /// Decay per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
    /// Variance of the Gaussian noise; default 0.1.
    #[schemars(range(min = 0))]
    pub noise_variance: f64,
}

impl Default for LightSensorConfig {
    fn default() -> Self {
        Self {
            n_sectors: 6,
            range: 80.0,
            color: "red".to_owned(),
            decay_rho: 0.05,
            decay_phi: 1.0,
            noise_variance: 0.1,
        }
    }
}

/// Distance sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("noise_sigma", schema::amount("Its square is `noise_variance`."))
)]
pub struct DistanceSensorConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 60.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Decay per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
    /// Variance of the Gaussian noise; default 0.1.
    #[schemars(range(min = 0))]
    pub noise_variance: f64,
}

impl Default for DistanceSensorConfig {
    fn default() -> Self {
        Self { n_sectors: 4, range: 60.0, decay_rho: 0.05, decay_phi: 1.0, noise_variance: 0.1 }
    }
}

/// Ground sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct GroundSensorConfig {
    /// Colour it sees; default "black".
    pub color: String,
}

impl Default for GroundSensorConfig {
    fn default() -> Self {
        Self { color: "black".to_owned() }
    }
}

/// Actuators; absent ones are not mounted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct ActuatorsConfig {
    /// Differential drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WheelActuatorConfig")]
    pub wheel_actuator: Option<WheelActuatorConfig>,
    /// LED.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "LedActuatorConfig")]
    pub led_actuator: Option<LedActuatorConfig>,
    /// Emitter of the wireless link.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "WirelessTransmitterConfig")]
    pub wireless_transmitter: Option<WirelessTransmitterConfig>,
}

impl ActuatorsConfig {
    /// Whether the actuator is mounted.
    pub fn has(&self, actuator: ActuatorQuery) -> bool {
        match actuator {
            ActuatorQuery::Wheels => self.wheel_actuator.is_some(),
            ActuatorQuery::Led => self.led_actuator.is_some(),
            ActuatorQuery::Message | ActuatorQuery::Mode => self.wireless_transmitter.is_some(),
        }
    }
}

/// Differential drive (section 3.2.1).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("dt", schema::amount("A fifth of it is `step_duration`.")),
    transform = schema::property("min_thresh", json!({"const": 0}))
)]
pub struct WheelActuatorConfig {
    /// Wheel speed at action 1, cm/s; default 10.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub max_speed: f64,
    /// Distance between the wheels L_w, cm; default 11.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub axle_length: f64,
    /// Duration of an environment step dk, s; default 0.33.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub step_duration: f64,
}

impl Default for WheelActuatorConfig {
    fn default() -> Self {
        Self { max_speed: 10.0, axle_length: 11.0, step_duration: 0.33 }
    }
}

/// LED.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct LedActuatorConfig {}

/// Emitter of the wireless link (section 3.3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct WirelessTransmitterConfig {
    /// Reach, cm; default 100. A frame is heard within the smaller of the
    /// emitter's and the receiver's reach.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Components of a message, M; default 2. Equals the receiver's.
    #[schemars(range(min = 1, max = limits::MESSAGE_LENGTH))]
    pub msg_length: u32,
    /// Whether messages are quantised; default true.
    pub quantize: bool,
    /// Number of lattice points K^M of the quantiser, M*; default 16.
    #[schemars(range(min = 2, max = limits::LATTICE_POINTS))]
    pub n_symbols: u32,
    /// Inverse temperature of the quantiser; default 100.
    #[schemars(range(min = 0))]
    pub beta: f64,
}

impl Default for WirelessTransmitterConfig {
    fn default() -> Self {
        Self { range: 100.0, msg_length: 2, quantize: true, n_symbols: 16, beta: 100.0 }
    }
}

impl WirelessTransmitterConfig {
    /// Levels per component of the quantiser, K = round(M*^(1/M)), Eq. 3.13.
    pub fn n_levels(&self) -> u32 {
        libm::round(libm::pow(self.n_symbols.into(), f64::from(self.msg_length).recip())) as u32
    }
}

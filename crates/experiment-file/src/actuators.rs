//! What robots act with.

use std::ops::Not;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::json;

use super::{ActuatorQuery, limits, schema};

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
    /// Steps at the start of an episode in which the robot sends, whatever its network
    /// says; default 10.
    #[serde(skip_serializing_if = "is_ten")]
    #[schemars(range(max = limits::STEPS))]
    pub sending_steps: u32,
    /// Whether a frame with the message 0 is on the air before the first step; default
    /// false.
    #[serde(skip_serializing_if = "Not::not")]
    pub initial_frame: bool,
}

/// Whether the canonical form leaves `sending_steps` out.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_ten(sending_steps: &u32) -> bool {
    *sending_steps == 10
}

impl Default for WirelessTransmitterConfig {
    fn default() -> Self {
        Self {
            range: 100.0,
            msg_length: 2,
            quantize: true,
            n_symbols: 16,
            beta: 100.0,
            sending_steps: 10,
            initial_frame: false,
        }
    }
}

impl WirelessTransmitterConfig {
    /// Levels per component of the quantiser, K = round(M*^(1/M)), Eq. 3.13.
    pub fn n_levels(&self) -> u32 {
        libm::round(libm::pow(self.n_symbols.into(), f64::from(self.msg_length).recip())) as u32
    }
}

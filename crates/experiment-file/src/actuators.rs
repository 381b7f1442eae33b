//! The actuators of robots.

use crate::DefaultValue::{Switch, Whole};
use crate::parameters::{Also, parameters};
use crate::{ActuatorQuery, Parameter, limits};

parameters! {
    /// Actuators; absent ones are not mounted.
    pub struct ActuatorsConfig: Default {
        /// Differential drive.
        wheel_actuator: Option<WheelActuatorConfig> = optional(WheelActuatorConfig::OBJECT),
        /// LED.
        led_actuator: Option<LedActuatorConfig> = optional(LedActuatorConfig::OBJECT),
        /// Emitter of the wireless link.
        wireless_transmitter: Option<WirelessTransmitterConfig> =
            optional(WirelessTransmitterConfig::OBJECT),
    }
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

/// SpikeSwarmSim moves a robot by `dt` times the sum of its actions, in cm. A step of `dt / 5`
/// seconds at 10 cm/s does the same.
const DT: Also = Also {
    key: "dt",
    max: limits::MAGNITUDE,
    meaning: "Replaces `step_duration`, which is a fifth of `dt`.",
    value: |dt| dt / 5.0,
};

parameters! {
    /// Differential drive (section 3.2.1 of the thesis).
    pub struct WheelActuatorConfig: Default {
        /// Wheel speed at action 1, cm/s.
        max_speed: f64 = positive(10.0),
        /// Distance between the wheels L_w, cm.
        axle_length: f64 = positive(11.0),
        /// Duration of an environment step dk, s.
        step_duration: f64 = positive(0.33).also(DT),
    }
    // Width of a dead zone, which SpikeSwarmSim lets files choose.
    checked { Parameter::between("min_thresh", [0.0; 2], 0.0, "Accepted if it is 0") }

    /// LED.
    pub struct LedActuatorConfig {}

    /// Emitter of the wireless link (section 3.3 of the thesis).
    pub struct WirelessTransmitterConfig: Default {
        /// Reach, cm. A frame is heard within the smaller of the emitter's and the receiver's
        /// reach.
        range: f64 = positive(100.0),
        /// Components of a message, M. It must equal the receiver's.
        msg_length: u32 = whole([1, limits::MESSAGE_LENGTH], 2),
        /// Whether messages are quantised.
        quantize: bool = switch(true),
        /// Number of lattice points K^M of the quantiser, M*.
        n_symbols: u32 = whole([2, limits::LATTICE_POINTS], 16),
        /// Inverse temperature of the quantiser.
        beta: f64 = amount(100.0),
        /// Steps at the start of an episode in which the robot always sends, whatever its network
        /// decides.
        sending_steps: u32 = whole([0, limits::STEPS], 10).original(Whole(11)).recent(),
        /// Whether a frame with the message 0 is on the air before the first step.
        initial_frame: bool = switch(false).original(Switch(true)).recent(),
    }
}

impl WirelessTransmitterConfig {
    /// Levels per component of the quantiser, K = round(M*^(1/M)), Eq. 3.13.
    pub fn n_levels(&self) -> u32 {
        libm::round(libm::pow(self.n_symbols.into(), f64::from(self.msg_length).recip())) as u32
    }
}

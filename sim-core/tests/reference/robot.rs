//! A robot, with its state.

use determinism::random::Stream;
use experiment_file::{RobotConfig, WirelessTransmitterConfig};

use super::communication::{Frame, Reception};
use super::controller::Controller;
use super::learning::Learner;
use super::reality::Reality;
use super::spiking::SpikingState;
use super::torus::Vector;

/// A robot: its configuration, its pose, and its last actions.
pub struct Robot<'a> {
    pub config: &'a RobotConfig,
    pub object_idx: usize,
    pub position: Vector,
    pub heading: f64,
    /// Its network, whose weights change if it learns.
    pub network: Controller,
    pub learner: Option<Learner<'a>>,
    /// State of a network of rate neurons.
    pub v: Vec<f64>,
    /// State of a network of spiking neurons.
    pub spiking: SpikingState,
    /// Mode in force: send (or relay).
    pub send: bool,
    pub led: u32,
    /// Actions of the right and left wheel.
    pub wheels: [f64; 2],
    pub on_air: Option<Frame>,
    pub received: Option<Reception>,
    pub is_faulty: bool,
    /// Whether it is affected, per entry of `stimuli_inhibition`.
    pub is_inhibited: Vec<bool>,
    pub is_uncontrollable: bool,
    pub reality: Option<Reality>,
    pub reception: Stream,
    pub quantisation: Stream,
    pub decoding: Stream,
    pub noise: Stream,
}

impl Robot<'_> {
    pub fn transmitter(&self) -> &WirelessTransmitterConfig {
        self.config
            .actuators
            .wireless_transmitter
            .as_ref()
            .expect("every emitter has a transmitter")
    }

    pub fn n_receiver_sectors(&self) -> u32 {
        self.config.sensors.wireless_receiver.as_ref().expect("emitters have sectors").n_sectors
    }

    /// Distance below which two robots of this kind hear each other, cm.
    pub fn communication_range(&self) -> f64 {
        let receiver = self.config.sensors.wireless_receiver.as_ref();
        let receiver = receiver.expect("the fitness function needs a receiver");
        receiver.range.min(self.transmitter().range)
    }

    /// Heading of the robot's radio.
    pub fn antenna_heading(&self) -> f64 {
        self.heading + self.reality.as_ref().map_or(0.0, |reality| reality.antenna_angle)
    }

    /// Factor of the reach of the robot's radio.
    pub fn radio_range(&self) -> f64 {
        self.reality.as_ref().map_or(1.0, |reality| reality.radio_range)
    }

    /// Message length M; 0 without a wireless link.
    pub fn msg_length(&self) -> usize {
        let sensors = &self.config.sensors;
        let actuators = &self.config.actuators;
        let receiver = sensors.wireless_receiver.as_ref().map(|receiver| receiver.msg_length);
        let transmitter = actuators.wireless_transmitter.as_ref().map(|config| config.msg_length);
        receiver.or(transmitter).unwrap_or(0) as usize
    }
}

//! `pseudo_reality`: a world unlike the one of the design.

use std::collections::VecDeque;

use determinism::random::{Purpose, Stream};
use experiment_file::RobotConfig;

use super::actuators::Actions;
use super::communication::Reception;

/// Stream numbers of a robot: this plus its own number.
const NOISE: usize = 1 << 32;
const LOSS: usize = 2 << 32;
const SIGNAL: usize = 3 << 32;

/// The reality of one robot in one trial.
pub struct Reality {
    pub wheel_factors: [f64; 2],
    delay: usize,
    gain: f64,
    offset: f64,
    deviation: f64,
    pub radio_range: f64,
    radio_loss: f64,
    pub antenna_angle: f64,
    /// Decided wheels and LEDs, the latest last.
    decided: VecDeque<([f64; 2], u32)>,
    pub noise: Stream,
    losses: Stream,
    signal: Stream,
}

/// The realities of the robots of an object, whose first robot has the number `first`; none without
/// `pseudo_reality`.
pub fn of_object(
    robots: &RobotConfig,
    object_idx: usize,
    first: usize,
    stream: &dyn Fn(Purpose, usize) -> Stream,
) -> Vec<Reality> {
    let Some(config) = &robots.perturbations.pseudo_reality else { return vec![] };
    let n = robots.num_instances as usize;
    let of_robot = |kind: usize, i: usize| stream(Purpose::PseudoReality, kind + first + i);
    let mut stream = stream(Purpose::PseudoReality, object_idx);
    let mut between = |low: f64, high: f64| low + stream.uniform() * (high - low);
    let wheel_gain = between(config.wheel_gain.low, config.wheel_gain.high);
    let wheel_asymmetry = between(config.wheel_asymmetry.low, config.wheel_asymmetry.high);
    let slow_factor = between(config.slow_robot.low, config.slow_robot.high);
    let delays = config.actuation_delay.low..=config.actuation_delay.high;
    let delay = between(0.0, delays.clone().count() as f64).floor() as usize;
    let delay = delays.start() + delay as u32;
    let gain = between(config.sensor_gain.low, config.sensor_gain.high);
    let offset = between(config.sensor_offset.low, config.sensor_offset.high);
    let deviation = between(config.sensor_noise.low, config.sensor_noise.high);
    let radio_range = between(config.radio_range.low, config.radio_range.high);
    let radio_loss = between(config.radio_loss.low, config.radio_loss.high);
    let antenna_heading = between(config.antenna_heading.low, config.antenna_heading.high);
    let slow_robot = between(0.0, n as f64).floor() as usize;
    let mut robots = Vec::new();
    for robot in 0..n {
        let asymmetry = between(-wheel_asymmetry, wheel_asymmetry);
        let antenna_angle = between(-antenna_heading, antenna_heading);
        let slow = if robot == slow_robot { slow_factor } else { 1.0 };
        robots.push(Reality {
            wheel_factors: [
                wheel_gain * slow * (1.0 + asymmetry / 2.0),
                wheel_gain * slow * (1.0 - asymmetry / 2.0),
            ],
            delay: delay as usize,
            gain,
            offset,
            deviation,
            radio_range,
            radio_loss,
            antenna_angle,
            decided: VecDeque::new(),
            noise: of_robot(NOISE, robot),
            losses: of_robot(LOSS, robot),
            signal: of_robot(SIGNAL, robot),
        });
    }
    robots
}

impl Reality {
    /// The actions that reach wheels and LED in this step.
    pub fn delayed(&mut self, mut actions: Actions) -> Actions {
        self.decided.push_back((actions.wheels, actions.led));
        let arrived = self.decided.len().checked_sub(self.delay + 1);
        (actions.wheels, actions.led) = arrived.map_or(([0.0; 2], 0), |i| self.decided[i]);
        actions
    }

    /// The frame that gets through, with the strength that the radio measures.
    pub fn received(&mut self, reception: Option<Reception>) -> Option<Reception> {
        let is_lost = self.losses.uniform() < self.radio_loss;
        let mut noise = self.signal.clone();
        let strength = reception.as_ref().map_or(0.0, |reception| reception.signal);
        let signal = self.measured(strength, &mut noise);
        self.signal = noise;
        reception.filter(|_| !is_lost).map(|reception| Reception { signal, ..reception })
    }

    /// What becomes of a value between 0 and 1.
    pub fn measured(&self, value: f64, noise: &mut Stream) -> f64 {
        let normal = if self.deviation > 0.0 { noise.normal() } else { 0.0 };
        (self.gain * value + self.offset + self.deviation * normal).clamp(0.0, 1.0)
    }
}

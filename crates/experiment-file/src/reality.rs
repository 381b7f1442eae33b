//! Pseudo-realities: simulators unlike the one of the design, as a robot's world is.

use std::f64::consts::PI;

use crate::parameters::parameters;
use crate::{ParameterValue, SensorQuery, limits};

/// A number, or a range from which each trial draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn<T> {
    /// The smallest value.
    pub low: T,
    /// The largest value, at least `low`.
    pub high: T,
}

impl<T: Copy> Drawn<T> {
    /// The same number in all trials.
    pub const fn always(number: T) -> Self {
        Self { low: number, high: number }
    }
}

impl Drawn<f64> {
    /// The number at a uniform number `u` in \[0, 1).
    pub fn at(self, u: f64) -> f64 {
        self.low + (self.high - self.low) * u
    }
}

impl Drawn<u32> {
    /// The whole number at a uniform number `u` in \[0, 1); all are equally probable.
    pub fn at(self, u: f64) -> u32 {
        let n = f64::from(self.high - self.low) + 1.0;
        // The product can round up to n.
        (self.low + (u * n) as u32).min(self.high)
    }
}

impl From<Drawn<f64>> for ParameterValue {
    fn from(Drawn { low, high }: Drawn<f64>) -> Self {
        if low == high { Self::Number(low) } else { Self::Numbers(vec![low, high]) }
    }
}

impl From<Drawn<u32>> for ParameterValue {
    fn from(Drawn { low, high }: Drawn<u32>) -> Self {
        if low == high { Self::Whole(low) } else { Self::Wholes(vec![low, high]) }
    }
}

impl TryFrom<ParameterValue> for Drawn<f64> {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Number(number) => Ok(Self::always(number)),
            value => value.try_into().map(|[low, high]: [f64; 2]| Self { low, high }),
        }
    }
}

impl TryFrom<ParameterValue> for Drawn<u32> {
    type Error = ParameterValue;

    fn try_from(value: ParameterValue) -> Result<Self, ParameterValue> {
        match value {
            ParameterValue::Whole(number) => Ok(Self::always(number)),
            ParameterValue::Wholes(pair) => match pair[..] {
                [low, high] => Ok(Self { low, high }),
                _ => Err(ParameterValue::Wholes(pair)),
            },
            other => Err(other),
        }
    }
}

/// Factors of a quantity.
const FACTORS: [f64; 2] = [0.0, 10.0];

parameters! {
    /// A world unlike the one in which the controller was designed. Each value is a number or a
    /// range `[low, high]`, from which every trial draws uniformly. Every default is neutral.
    #[derive(Copy)]
    pub struct PseudoRealityConfig: Default {
        /// Factor of the speed of both wheels. A longer step of the environment is the same thing.
        wheel_gain: Drawn<f64> = drawn(FACTORS, 1.0),
        /// Largest asymmetry of the wheels. Each robot draws its own asymmetry a between minus and
        /// plus this value; the speed of its right wheel is multiplied by 1 + a/2, and that of its
        /// left wheel by 1 - a/2.
        wheel_asymmetry: Drawn<f64> = drawn([0.0, 2.0], 0.0),
        /// Factor of the speed of the wheels of one robot, which every trial draws.
        slow_robot: Drawn<f64> = drawn([0.0, 1.0], 1.0),
        /// Steps by which wheels and LED lag behind the decision. Before the first decision
        /// arrives, the wheels stand and the LED is off.
        actuation_delay: Drawn<u32> = drawn_whole([0, limits::ACTUATION_DELAY], 0),
        /// Factor of every value that a sensor measures, and of the strength of the received frame.
        /// Messages, directions, positions and the robot's own state stay as they are.
        sensor_gain: Drawn<f64> = drawn(FACTORS, 1.0),
        /// What is added to these values, as a share of the sensor's range.
        sensor_offset: Drawn<f64> = drawn([-1.0, 1.0], 0.0),
        /// Standard deviation of Gaussian noise on these values, as a share of the sensor's range.
        sensor_noise: Drawn<f64> = drawn([0.0, 1.0], 0.0),
        /// Factor of the reach of receivers and transmitters.
        radio_range: Drawn<f64> = drawn(FACTORS, 1.0),
        /// Probability, per robot and step, that the robot receives nothing. Then it has nothing to
        /// relay.
        radio_loss: Drawn<f64> = drawn([0.0, 1.0], 0.0),
        /// Largest angle by which the radio is mounted askew, radians. Each robot draws its own
        /// angle between minus and plus this value.
        antenna_heading: Drawn<f64> = drawn([0.0, PI], 0.0),
        /// Version of these perturbations, on which every bit of a result depends.
        format: u32 = whole([1, 1], 1),
    }
}

impl PseudoRealityConfig {
    /// One of these realities, with a number for every range. `uniform` returns a uniform number in
    /// \[0, 1) for each key, in the order of the keys.
    #[must_use]
    pub fn draw(&self, mut uniform: impl FnMut() -> f64) -> Self {
        let mut number = |drawn: Drawn<f64>| Drawn::always(drawn.at(uniform()));
        let wheel_gain = number(self.wheel_gain);
        let wheel_asymmetry = number(self.wheel_asymmetry);
        let slow_robot = number(self.slow_robot);
        let actuation_delay = Drawn::always(self.actuation_delay.at(uniform()));
        let mut number = |drawn: Drawn<f64>| Drawn::always(drawn.at(uniform()));
        Self {
            wheel_gain,
            wheel_asymmetry,
            slow_robot,
            actuation_delay,
            sensor_gain: number(self.sensor_gain),
            sensor_offset: number(self.sensor_offset),
            sensor_noise: number(self.sensor_noise),
            radio_range: number(self.radio_range),
            radio_loss: number(self.radio_loss),
            antenna_heading: number(self.antenna_heading),
            format: self.format,
        }
    }

    /// The largest factor of the speed of a wheel.
    pub fn wheel_factor_max(&self) -> f64 {
        self.wheel_gain.high * (1.0 + self.wheel_asymmetry.high / 2.0)
    }
}

impl SensorQuery {
    /// Whether a sensor measures the values of the reading, so that a pseudo-reality distorts them.
    /// Messages, directions, positions and the robot's own state are not measured.
    pub const fn is_measured(self) -> bool {
        match self {
            Self::ReceiverSignal
            | Self::Light
            | Self::Distance
            | Self::Ground
            | Self::FoodArea
            | Self::Nest
            | Self::Script
            | Self::Proximity
            | Self::Contact => true,
            Self::ReceiverMessage
            | Self::ReceiverReceivingDirection
            | Self::ReceiverSendingDirection
            | Self::ReceiverState
            | Self::Food
            | Self::OwnPosition
            | Self::OwnOrientation
            | Self::NeighborhoodPos => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_gives_all_its_numbers_and_a_number_itself() {
        let range = Drawn { low: 0.5, high: 1.5 };
        assert_eq!([0.0, 0.25, 0.5].map(|u| range.at(u)), [0.5, 0.75, 1.0]);
        assert_eq!(Drawn::always(0.1).at(0.999), 0.1);
        let below_one = 1.0 - f64::EPSILON / 2.0;
        let whole = Drawn { low: 2_u32, high: 4 };
        assert_eq!([0.0, 0.34, 0.67, below_one].map(|u| whole.at(u)), [2, 3, 4, 4]);
        assert_eq!(Drawn::always(7_u32).at(below_one), 7);
    }

    #[test]
    fn every_key_has_its_own_draw() {
        let ranges = PseudoRealityConfig {
            wheel_gain: Drawn { low: 0.0, high: 10.0 },
            actuation_delay: Drawn { low: 0, high: 9 },
            antenna_heading: Drawn { low: 0.0, high: 1.0 },
            ..Default::default()
        };
        let mut draws = (0..).map(|draw| f64::from(draw) / 10.0);
        let drawn = ranges.draw(|| draws.next().unwrap());
        assert_eq!(drawn.wheel_gain, Drawn::always(0.0));
        assert_eq!(drawn.actuation_delay, Drawn::always(3));
        assert_eq!(drawn.antenna_heading, Drawn::always(0.9));
        assert_eq!(drawn.sensor_gain, Drawn::always(1.0));
        assert_eq!(draws.next(), Some(1.0));
    }
}

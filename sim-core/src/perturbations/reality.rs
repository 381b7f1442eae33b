//! `pseudo_reality`: a world unlike the one of the design, for the robots of one object in one
//! trial.

use std::collections::VecDeque;

use determinism::random::Stream;
use experiment_file::PseudoRealityConfig;

/// The reality of one trial. Perturbations delay actions; other parts of a trial carry out the
/// rest.
#[derive(Debug, Clone)]
pub(crate) struct Reality {
    /// Factors of the speed of the right and left wheel, per robot.
    pub wheel_factors: Vec<[f64; 2]>,
    /// What becomes of measured values.
    pub sensing: Sensing,
    /// Factor of the reach of receivers and transmitters.
    pub radio_range: f64,
    /// Probability that a robot receives nothing in a step.
    pub radio_loss: f64,
    /// Angle by which each radio is mounted askew, radians.
    pub antenna_angles: Vec<f64>,
    lag: Lag,
}

/// What becomes of the values that sensors measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensing {
    gain: f64,
    /// As a share of the sensor's range.
    offset: f64,
    /// Standard deviation, as a share of the sensor's range.
    deviation: f64,
}

impl Sensing {
    /// A measured value of a sensor whose range has this width. `normal`: a standard normal number.
    pub fn distort(self, value: f64, width: f64, normal: f64) -> f64 {
        self.gain * value + width * (self.offset + self.deviation * normal)
    }

    /// Whether it needs standard normal numbers.
    pub fn is_noisy(self) -> bool {
        self.deviation > 0.0
    }
}

impl Reality {
    /// Draws the reality of a trial: a number per key, the slow robot, and then two numbers per
    /// robot. All of them are drawn, needed or not, so that no key changes the draws of another.
    pub fn new(config: &PseudoRealityConfig, n_robots: usize, stream: &mut Stream) -> Self {
        let drawn = config.draw(|| stream.uniform());
        let slow_robot = stream.below(n_robots.max(1));
        let mut wheel_factors = Vec::with_capacity(n_robots);
        let mut antenna_angles = Vec::with_capacity(n_robots);
        for robot in 0..n_robots {
            let mut within = |limit: f64| limit * (2.0 * stream.uniform() - 1.0);
            let asymmetry = within(drawn.wheel_asymmetry.low);
            antenna_angles.push(within(drawn.antenna_heading.low));
            let slow = if robot == slow_robot { drawn.slow_robot.low } else { 1.0 };
            let gain = drawn.wheel_gain.low * slow;
            wheel_factors.push([gain * (1.0 + asymmetry / 2.0), gain * (1.0 - asymmetry / 2.0)]);
        }
        Self {
            wheel_factors,
            sensing: Sensing {
                gain: drawn.sensor_gain.low,
                offset: drawn.sensor_offset.low,
                deviation: drawn.sensor_noise.low,
            },
            radio_range: drawn.radio_range.low,
            radio_loss: drawn.radio_loss.low,
            antenna_angles,
            lag: Lag { n_steps: drawn.actuation_delay.low as usize, decided: VecDeque::new() },
        }
    }

    /// Replaces decided actions by those that arrive in this step.
    pub fn delay(&mut self, wheels: &mut [[f64; 2]], leds: &mut [u32]) {
        self.lag.delay(wheels, leds);
    }
}

/// Actions on their way to wheels and LEDs.
#[derive(Debug, Clone)]
struct Lag {
    n_steps: usize,
    /// The decisions of the last steps, the oldest first: wheels and LED of each robot.
    decided: VecDeque<Vec<([f64; 2], u32)>>,
}

impl Lag {
    fn delay(&mut self, wheels: &mut [[f64; 2]], leds: &mut [u32]) {
        if self.n_steps == 0 {
            return;
        }
        let actions = wheels.iter().copied().zip(leds.iter().copied()).collect();
        self.decided.push_back(actions);
        let arrived =
            if self.decided.len() > self.n_steps { self.decided.pop_front() } else { None };
        match arrived {
            None => {
                wheels.fill([0.0; 2]);
                leds.fill(0);
            }
            Some(arrived) => {
                for ((wheels, led), arrived) in wheels.iter_mut().zip(leds).zip(arrived) {
                    (*wheels, *led) = arrived;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;
    use experiment_file::Drawn;

    fn reality(config: &PseudoRealityConfig, n_robots: usize, trial: u64) -> Reality {
        let mut stream = Stream::new(0, 0, trial, Purpose::PseudoReality, 0);
        Reality::new(config, n_robots, &mut stream)
    }

    #[test]
    fn the_neutral_reality_changes_nothing() {
        let mut neutral = reality(&PseudoRealityConfig::default(), 3, 0);
        assert_eq!(neutral.wheel_factors, [[1.0; 2]; 3]);
        assert_eq!(neutral.antenna_angles, [0.0; 3]);
        assert_eq!((neutral.radio_range, neutral.radio_loss), (1.0, 0.0));
        assert!(!neutral.sensing.is_noisy());
        assert_eq!(neutral.sensing.distort(0.3, 7.0, 1.5), 0.3);
        let (mut wheels, mut leds) = ([[0.1, -0.2]; 3], [2; 3]);
        neutral.delay(&mut wheels, &mut leds);
        assert_eq!((wheels, leds), ([[0.1, -0.2]; 3], [2; 3]));
    }

    #[test]
    fn actions_arrive_in_their_order_and_wheels_stand_until_then() {
        let config =
            PseudoRealityConfig { actuation_delay: Drawn::always(2), ..Default::default() };
        let mut late = reality(&config, 1, 0);
        for step in 0..6_u32 {
            let (mut wheels, mut leds) = ([[f64::from(step), 0.5]], [step + 1]);
            late.delay(&mut wheels, &mut leds);
            let expected = step.checked_sub(2).map(|past| ([f64::from(past), 0.5], past + 1));
            assert_eq!((wheels[0], leds[0]), expected.unwrap_or(([0.0; 2], 0)), "step {step}");
        }
    }

    #[test]
    fn each_robot_draws_its_asymmetry_and_angle_and_one_robot_is_slow() {
        let config = PseudoRealityConfig {
            wheel_gain: Drawn::always(0.8),
            wheel_asymmetry: Drawn::always(0.2),
            slow_robot: Drawn::always(0.5),
            antenna_heading: Drawn::always(0.3),
            ..Default::default()
        };
        let swarm = reality(&config, 100, 0);
        let mut n_slow = 0;
        for &[right, left] in &swarm.wheel_factors {
            let gain = (right + left) / 2.0;
            n_slow += usize::from((gain - 0.4).abs() < 1e-12);
            assert!((gain - 0.4).abs() < 1e-12 || (gain - 0.8).abs() < 1e-12);
            assert!(((right - left) / gain).abs() <= 0.2);
        }
        assert_eq!(n_slow, 1);
        let reach = |values: &[f64]| {
            values.iter().fold([0.0_f64; 2], |[low, high], &x| [low.min(x), high.max(x)])
        };
        let [low, high] = reach(&swarm.antenna_angles);
        assert!((-0.3..-0.25).contains(&low) && (0.25..0.3).contains(&high), "{low} {high}");
        assert_ne!(reality(&config, 100, 1).wheel_factors, swarm.wheel_factors);
        assert_eq!(reality(&config, 100, 0).wheel_factors, swarm.wheel_factors);
    }

    #[test]
    fn a_key_does_not_change_the_draws_of_another() {
        let range = Drawn { low: 0.0, high: 1.0 };
        let one = PseudoRealityConfig { radio_loss: range, ..Default::default() };
        let both = PseudoRealityConfig { wheel_gain: range, ..one };
        assert_eq!(reality(&one, 2, 3).radio_loss, reality(&both, 2, 3).radio_loss);
    }
}

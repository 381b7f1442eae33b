//! Differential drive (section 3.2.1, Eq. 3.3): exact motion along an arc.

use crate::torus::{Torus, Vec2, wrap_angle};

/// A robot's wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drive {
    /// Wheel speed at action 1, cm/s.
    pub max_speed: f64,
    /// Distance between the wheels, cm.
    pub axle_length: f64,
    /// Duration of an environment step, s.
    pub step_duration: f64,
}

impl Drive {
    /// Speed, cm/s, and rate of turning, rad/s, for these actions of the right and left wheel, in
    /// \[-1, 1\].
    pub fn asks(&self, wheels: [f64; 2]) -> (f64, f64) {
        let [right, left] = wheels.map(|action| action * self.max_speed);
        (0.5 * (right + left), (right - left) / self.axle_length)
    }

    /// The pose after one step with these actions of the right and left wheel, in \[-1, 1\].
    pub fn advance(
        &self,
        torus: &Torus,
        position: Vec2,
        heading: f64,
        wheels: [f64; 2],
    ) -> (Vec2, f64) {
        let (speed, turning) = self.asks(wheels);
        let turn = turning * self.step_duration;
        // The chord of the arc: 2 r sin(turn / 2), with r = length / turn, in the
        // direction half-way between the headings.
        let length = speed * self.step_duration;
        let chord = if length == 0.0 { 0.0 } else { length * sinc(0.5 * turn) };
        let way = if chord == 0.0 { Vec2::default() } else { Vec2::unit(heading + 0.5 * turn) };
        let way = Vec2 { x: chord * way.x, y: chord * way.y };
        let position = torus.wrap(Vec2 { x: position.x + way.x, y: position.y + way.y });
        (position, wrap_angle(heading + turn))
    }
}

/// sin(x) / x
fn sinc(x: f64) -> f64 {
    // The next term of the series is below half an ulp of 1.
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { libm::sin(x) / x }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    use proptest::prelude::*;

    use super::*;

    const TORUS: Torus = Torus::new(1000.0, 1000.0);
    const DRIVE: Drive = Drive { max_speed: 10.0, axle_length: 11.0, step_duration: 0.33 };

    fn assert_pose(actual: (Vec2, f64), (x, y, heading): (f64, f64, f64)) {
        let (position, theta) = actual;
        assert!(TORUS.distance(position, Vec2::new(x, y)) < 1e-9, "{position:?}");
        assert!((theta - heading).abs() < 1e-12, "{theta}");
    }

    #[test]
    fn equal_wheels_go_straight_and_across_the_seam() {
        let start = Vec2::new(999.0, 500.0);
        assert_pose(DRIVE.advance(&TORUS, start, 0.0, [1.0, 1.0]), (2.3, 500.0, 0.0));
        let up = DRIVE.advance(&TORUS, start, FRAC_PI_2, [-0.5, -0.5]);
        assert_pose(up, (999.0, 498.35, FRAC_PI_2));
    }

    #[test]
    fn opposite_wheels_turn_in_place() {
        let start = Vec2::new(123.456, 789.012);
        let (position, heading) = DRIVE.advance(&TORUS, start, 0.0, [1.0, -1.0]);
        assert_eq!(position, start);
        assert!((heading - 0.6).abs() < 1e-12, "20 cm/s over 11 cm for 0.33 s");
        let (_, heading) = DRIVE.advance(&TORUS, start, 0.0, [-1.0, 1.0]);
        assert!((heading - (TAU - 0.6)).abs() < 1e-12);
    }

    #[test]
    fn one_wheel_drives_an_arc_around_the_other() {
        // A drive that turns by a quarter in one step, around its left wheel.
        let drive = Drive { max_speed: PI, axle_length: 2.0, step_duration: 1.0 };
        let pose = drive.advance(&TORUS, Vec2::new(10.0, 10.0), 0.0, [1.0, 0.0]);
        assert_pose(pose, (11.0, 11.0, FRAC_PI_2));
    }

    #[test]
    fn a_standing_robot_does_not_move_a_bit() {
        let start = Vec2::new(123.456, 789.012);
        assert_eq!(DRIVE.advance(&TORUS, start, 1.234, [0.0, 0.0]), (start, 1.234));
    }

    proptest! {
        #[test]
        fn steps_are_short_and_headings_stay_in_range(
            heading in 0.0..TAU, right in -1.0..=1.0f64, left in -1.0..=1.0f64,
        ) {
            let start = Vec2::new(1.0, 1.0);
            let (position, turned) = DRIVE.advance(&TORUS, start, heading, [right, left]);
            prop_assert!(TORUS.distance(start, position) <= 3.3 + 1e-9);
            prop_assert!((0.0..TAU).contains(&turned));
        }

        #[test]
        fn the_arc_tends_to_the_straight_line(heading in 0.0..TAU, speed in -1.0..=1.0f64) {
            let start = Vec2::new(500.0, 500.0);
            let straight = DRIVE.advance(&TORUS, start, heading, [speed, speed]).0;
            let arc = DRIVE.advance(&TORUS, start, heading, [speed + 1e-7, speed]).0;
            prop_assert!(TORUS.distance(straight, arc) < 1e-5);
        }
    }
}

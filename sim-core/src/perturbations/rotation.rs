//! `uncontrollable_rotation`: some robots turn to a target heading and hold it, whatever their
//! network decides.

use super::draw_affected;
use crate::torus::{angular_difference, wrap_angle};
use determinism::random::Stream;
use experiment_file::UncontrollableRotationConfig;

/// Distance from the target within which a robot holds its heading, radians.
const ARRIVED: f64 = 0.15;

/// The affected robots, their targets, and the steps.
#[derive(Debug, Clone)]
pub(super) struct Rotation {
    affected: Vec<bool>,
    start: u32,
    /// In \[0, 2 pi).
    targets: Vec<f64>,
    switch_at: u32,
    /// Action of the right wheel during a turn; the left wheel gets its negative.
    speed: f64,
}

impl Rotation {
    /// Draws the affected robots.
    pub fn new(
        config: &UncontrollableRotationConfig,
        n_robots: usize,
        stream: &mut Stream,
    ) -> Self {
        Self {
            affected: draw_affected(config.affected_robots, n_robots, stream),
            start: config.start,
            targets: config.targets.iter().map(|&target| wrap_angle(target)).collect(),
            switch_at: config.switch_at.max(1),
            speed: config.speed,
        }
    }

    /// Overwrites the wheel actions of affected robots.
    pub fn rewrite(&self, step: u32, headings: &[f64], wheels: &mut [[f64; 2]]) {
        let index = (step / self.switch_at) as usize;
        let Some(&target) = self.targets.get(index).or(self.targets.last()) else { return };
        if step < self.start {
            return;
        }
        for ((wheels, heading), affected) in wheels.iter_mut().zip(headings).zip(&self.affected) {
            if *affected {
                let arrived = angular_difference(*heading, target) <= ARRIVED;
                *wheels = if arrived { [0.0; 2] } else { [self.speed, -self.speed] };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    const TURN: [f64; 2] = [0.3, -0.3];
    const HOLD: [f64; 2] = [0.0, 0.0];
    const OWN: [f64; 2] = [0.7, 0.1];

    fn rewritten(step: u32, heading: f64, affected_robots: u32) -> [f64; 2] {
        let config = UncontrollableRotationConfig {
            affected_robots,
            start: 200,
            targets: vec![1.0, -1.0],
            switch_at: 600,
            speed: 0.3,
        };
        let mut stream = Stream::new(0, 0, 0, Purpose::Perturbation, 3);
        let mut wheels = [OWN];
        Rotation::new(&config, 1, &mut stream).rewrite(step, &[heading], &mut wheels);
        wheels[0]
    }

    #[test]
    fn affected_robots_turn_and_hold_from_the_start_on() {
        assert_eq!(rewritten(199, 3.0, 1), OWN);
        assert_eq!(rewritten(200, 3.0, 1), TURN);
        assert_eq!(rewritten(599, 0.86, 1), HOLD);
        assert_eq!(rewritten(599, 1.14, 1), HOLD);
        assert_eq!(rewritten(300, 1.16, 1), TURN);
        assert_eq!(rewritten(300, 3.0, 0), OWN);
    }

    #[test]
    fn the_target_switches_and_the_last_one_stays() {
        let second = std::f64::consts::TAU - 1.0;
        assert_eq!(rewritten(599, second, 1), TURN);
        assert_eq!(rewritten(600, second, 1), HOLD);
        assert_eq!(rewritten(600, 1.0, 1), TURN);
        assert_eq!(rewritten(60_000, second, 1), HOLD);
    }
}

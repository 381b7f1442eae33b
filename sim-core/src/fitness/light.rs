//! `goto_light`: robots are near the light.

use super::{Fitness, Moment, mean};

/// Distance to the light that counts as near, cm.
const NEAR: f64 = 80.0;

/// f = share of robots within 80 cm of a light.
#[derive(Debug)]
pub(super) struct GotoLight;

impl Fitness for GotoLight {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        let near = moment.positions.iter().map(|&robot| {
            let near = |&light| moment.torus.distance(robot, light) <= NEAR;
            f64::from(moment.lights.iter().any(near))
        });
        Some(mean(near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::torus::Vec2;

    #[test]
    fn fitness_is_the_share_of_robots_near_the_light() {
        let light = [Vec2::new(990.0, 500.0)];
        let positions = [
            Vec2::new(990.0, 500.0),
            Vec2::new(70.0, 500.0),
            Vec2::new(71.0, 500.0),
            Vec2::new(500.0, 500.0),
        ];
        let moment = Moment { positions: &positions, lights: &light, ..Moment::EMPTY };
        assert_eq!(GotoLight.step(&moment), Some(0.5));
        assert_eq!(GotoLight.step(&Moment { lights: &[], ..moment }), Some(0.0));
    }
}

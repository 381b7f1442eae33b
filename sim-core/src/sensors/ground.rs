//! Ground sensor: whether the robot stands on an area of its colour.

use crate::torus::{Torus, Vec2};

/// A ground sensor and the areas that it can see.
#[derive(Debug, Clone)]
pub(crate) struct GroundSensor {
    /// Areas of its colour, each with its radius, cm.
    pub areas: Vec<(usize, f64)>,
}

impl GroundSensor {
    /// 1 on an area, else 0; `areas` are the centres of all areas.
    pub fn sense(&self, torus: &Torus, position: Vec2, areas: &[Vec2]) -> f64 {
        let stands_on =
            |&(area, radius): &(usize, f64)| torus.distance(position, areas[area]) <= radius;
        f64::from(self.areas.iter().any(stands_on))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_stands_on_areas_of_the_colour_only() {
        let torus = Torus { width: 1000.0, height: 1000.0 };
        let areas = [Vec2::new(0.0, 0.0), Vec2::new(500.0, 500.0)];
        let sensor = GroundSensor { areas: vec![(0, 100.0)] };
        let sense = |x, y| sensor.sense(&torus, Vec2::new(x, y), &areas);
        assert_eq!(sense(60.0, 920.0), 1.0);
        assert_eq!(sense(0.0, 100.0), 1.0);
        assert_eq!(sense(0.0, 101.0), 0.0);
        assert_eq!(sense(500.0, 500.0), 0.0);
    }
}

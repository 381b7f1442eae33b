//! Ground sensor: whether the robot stands on an area of its colour.

use super::{Noise, Sensor, Surroundings, Viewpoint};
use crate::objects::StaticObjects;
use experiment_file::GroundSensorConfig;

/// A ground sensor and the areas that it can see. Its reading is 1 on an area,
/// else 0.
#[derive(Debug, Clone)]
pub(crate) struct GroundSensor {
    /// Areas of its colour, each with its radius, cm.
    areas: Vec<(usize, f64)>,
}

impl GroundSensor {
    /// As configured, for those of `areas` that have its colour.
    pub fn new(config: &GroundSensorConfig, areas: &[StaticObjects]) -> Self {
        Self { areas: StaticObjects::of_color(areas, &config.color).collect() }
    }
}

impl Sensor for GroundSensor {
    fn reading_len(&self) -> usize {
        1
    }

    fn noise(&self) -> Noise {
        Noise::NONE
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        let Surroundings { torus, areas, .. } = surroundings;
        let stands_on =
            |&(area, radius): &(usize, f64)| torus.distance(from.position, areas[area]) <= radius;
        reading[0] = f64::from(self.areas.iter().any(stands_on));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbours::Neighbours;
    use crate::torus::{Torus, Vec2};

    #[test]
    fn a_robot_stands_on_areas_of_the_colour_only() {
        let torus = Torus { width: 1000.0, height: 1000.0 };
        let areas = [Vec2::new(0.0, 0.0), Vec2::new(500.0, 500.0)];
        let sensor = GroundSensor { areas: vec![(0, 100.0)] };
        let neighbours = &Neighbours::new(0.0, 1);
        let surroundings = Surroundings { torus: &torus, neighbours, lights: &[], areas: &areas };
        let sense = |x, y| {
            let from = Viewpoint { robot: 0, position: Vec2::new(x, y), heading: 0.0 };
            let mut reading = [7.0];
            sensor.sense(from, &surroundings, &mut reading);
            reading[0]
        };
        assert_eq!(sense(60.0, 920.0), 1.0);
        assert_eq!(sense(0.0, 100.0), 1.0);
        assert_eq!(sense(0.0, 101.0), 0.0);
        assert_eq!(sense(500.0, 500.0), 0.0);
    }
}

//! The ground: whether the robot stands on an area of some colour.

use super::{Sensor, Surroundings, Viewpoint};
use crate::objects::StaticObjects;
use crate::world::World;
use experiment_file::{GroundSensorConfig, PlainSensorConfig};

pub(super) fn ground_sensor(config: &GroundSensorConfig, world: &World) -> GroundSensor {
    GroundSensor::new(&config.color, world)
}

pub(super) fn food_area_sensor(_: &PlainSensorConfig, world: &World) -> GroundSensor {
    GroundSensor::new("green", world)
}

pub(super) fn nest_sensor(_: &PlainSensorConfig, world: &World) -> GroundSensor {
    GroundSensor::new("black", world)
}

/// A ground sensor and the areas that it can see. Its reading is 1 on an area,
/// else 0.
#[derive(Debug, Clone)]
pub(crate) struct GroundSensor {
    /// Areas of its colour, each with its radius, cm.
    areas: Vec<(usize, f64)>,
}

impl GroundSensor {
    /// A sensor for the areas of this colour.
    fn new(color: &str, world: &World) -> Self {
        Self { areas: StaticObjects::of_color(&world.areas, color).collect() }
    }
}

impl Sensor for GroundSensor {
    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        let Surroundings { torus, areas, switches, .. } = surroundings;
        let stands_on = |&(area, radius): &(usize, f64)| {
            switches.areas[area] && torus.distance(from.position, areas[area]) <= radius
        };
        reading[0] = f64::from(self.areas.iter().any(stands_on));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::neighbours::Neighbours;
    use crate::objects::Switches;
    use crate::swarm::Swarm;
    use crate::torus::{Torus, Vec2};

    #[test]
    fn a_robot_stands_on_areas_of_the_colour_only() {
        let torus = Torus::new(1000.0, 1000.0);
        let areas = [Vec2::new(0.0, 0.0), Vec2::new(500.0, 500.0)];
        let sensor = GroundSensor { areas: vec![(0, 100.0)] };
        let neighbours = &Neighbours::new(0.0, 1);
        let sense_with = |switches: &Switches, x, y| {
            let surroundings = Surroundings {
                torus: &torus,
                swarm: &Swarm::new(Vec::new(), Vec::new(), 0),
                neighbours,
                lights: &[],
                areas: &areas,
                switches,
                bodies: None,
            };
            let from = Viewpoint { robot: 0, position: Vec2::new(x, y), heading: 0.0 };
            let mut reading = [7.0];
            sensor.sense(from, &surroundings, &mut reading);
            reading[0]
        };
        let on = Switches { lights: Vec::new(), areas: vec![true; 2] };
        let sense = |x, y| sense_with(&on, x, y);
        assert_eq!(sense(60.0, 920.0), 1.0);
        assert_eq!(sense(0.0, 100.0), 1.0);
        assert_eq!(sense(0.0, 101.0), 0.0);
        assert_eq!(sense(500.0, 500.0), 0.0);
        let off = Switches { areas: vec![false, true], ..on.clone() };
        assert_eq!(sense_with(&off, 60.0, 920.0), 0.0);
    }
}

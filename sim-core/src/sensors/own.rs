//! Sensors of a robot's own state: its position, its heading, and whether it carries something.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use super::{Sensor, Surroundings, Viewpoint};
use crate::world::World;
use experiment_file::PlainSensorConfig;

pub(super) fn own_position_sensor(_: &PlainSensorConfig, _: &World) -> OwnPositionSensor {
    OwnPositionSensor
}

pub(super) fn own_orientation_sensor(_: &PlainSensorConfig, _: &World) -> OwnOrientationSensor {
    OwnOrientationSensor
}

pub(super) fn food_sensor(_: &PlainSensorConfig, _: &World) -> FoodSensor {
    FoodSensor
}

/// Position: x and y, cm.
#[derive(Debug, Clone)]
pub(crate) struct OwnPositionSensor;

impl Sensor for OwnPositionSensor {
    fn value_range(&self) -> RangeInclusive<f64> {
        0.0..=f64::MAX
    }

    fn sense(&self, from: Viewpoint, _: &Surroundings<'_>, reading: &mut [f64]) {
        (reading[0], reading[1]) = (from.position.x, from.position.y);
    }
}

/// Heading, in turns: \[0, 1).
#[derive(Debug, Clone)]
pub(crate) struct OwnOrientationSensor;

impl Sensor for OwnOrientationSensor {
    fn sense(&self, from: Viewpoint, _: &Surroundings<'_>, reading: &mut [f64]) {
        reading[0] = from.heading / TAU;
    }
}

/// 1 if the robot carries something, else 0.
#[derive(Debug, Clone)]
pub(crate) struct FoodSensor;

impl Sensor for FoodSensor {
    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading[0] = f64::from(surroundings.swarm.carries[from.robot]);
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
    fn a_robot_knows_itself() {
        let torus = &Torus::new(1000.0, 800.0);
        let (position, heading) = (Vec2::new(730.0, 20.0), 0.75 * TAU);
        let mut swarm = Swarm::new(vec![Vec2::default(), position], vec![0.0, heading], 0);
        swarm.carries[1] = true;
        let neighbours = &Neighbours::new(0.0, 2);
        let switches = &Switches { lights: Vec::new(), areas: Vec::new() };
        let swarm = &swarm;
        let surroundings = Surroundings {
            torus,
            swarm,
            neighbours,
            lights: &[],
            areas: &[],
            switches,
            bodies: None,
        };
        let read = |sensor: &dyn Sensor, robot: usize, reading_len: usize| {
            let (position, heading) = (swarm.positions[robot], swarm.headings[robot]);
            let mut reading = vec![7.0; reading_len];
            sensor.sense(Viewpoint { robot, position, heading }, &surroundings, &mut reading);
            assert!(reading.iter().all(|value| sensor.value_range().contains(value)));
            reading
        };
        assert_eq!(read(&OwnPositionSensor, 1, 2), [730.0, 20.0]);
        assert_eq!(read(&OwnOrientationSensor, 1, 1), [0.75]);
        assert_eq!((read(&FoodSensor, 0, 1), read(&FoodSensor, 1, 1)), (vec![0.0], vec![1.0]));
    }
}

//! Sensors of bodies: how near they are, and what touches the robot.

use super::{Sensor, Surroundings, Viewpoint};
use crate::world::World;
use experiment_file::{ContactSensorConfig, ProximitySensorConfig};

pub(super) fn proximity_sensor(config: &ProximitySensorConfig, _: &World) -> ProximitySensorConfig {
    config.clone()
}

impl Sensor for ProximitySensorConfig {
    fn sense(&self, _: Viewpoint, _: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
    }
}

pub(super) fn contact_sensor(config: &ContactSensorConfig, _: &World) -> ContactSensorConfig {
    config.clone()
}

impl Sensor for ContactSensorConfig {
    fn sense(&self, _: Viewpoint, _: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
    }
}

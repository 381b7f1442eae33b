//! Sensors of bodies: how near they are along rays, and where the robot touches them.

use std::f64::consts::TAU;

use super::{Noise, NoiseStream, Sensor, Surroundings, Viewpoint};
use crate::torus::{Vec2, sector_angle, wrap_angle};
use crate::world::World;
use experiment_file::{ContactSensorConfig, ProximitySensorConfig, Sees};

/// Rays from the rim of a robot. Readings in \[0, 1\], one per ray.
#[derive(Debug, Clone)]
pub(crate) struct ProximitySensor {
    /// (cos, sin) of each ray in the robot's own frame.
    rays: Vec<Vec2>,
    range: f64,
    sees: Sees,
    noise_deviation: f64,
    /// Distance beyond which no robot's rim is within `range`, from centre to centre, cm.
    robots_within: f64,
}

pub(super) fn proximity_sensor(config: &ProximitySensorConfig, world: &World) -> ProximitySensor {
    let n_rays = config.n_rays as usize;
    let angles = config.angles.clone();
    let angles = angles
        .unwrap_or_else(|| (0..n_rays).map(|ray| sector_angle(ray, n_rays)).collect::<Vec<_>>());
    let radius = world.room.as_ref().map_or(0.0, |room| room.largest_radius);
    ProximitySensor {
        rays: angles.into_iter().map(Vec2::unit).collect(),
        range: config.range,
        sees: config.sees,
        noise_deviation: config.noise_sigma,
        robots_within: config.range + 2.0 * radius,
    }
}

/// 1 - distance / range of the first thing on each ray, 0 if there is none within the range.
impl Sensor for ProximitySensor {
    fn noise(&self) -> Noise {
        Noise { deviation: self.noise_deviation, stream: NoiseStream::PROXIMITY }
    }

    fn robots_within(&self) -> f64 {
        if self.sees.robots { self.robots_within } else { 0.0 }
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
        let Some(bodies) = surroundings.bodies else { return };
        let radius = bodies.radius(from.robot);
        let robots = surroundings.neighbours.of_robot(from.robot);
        let robots = robots.map(|neighbour| neighbour.robot);
        let sight = bodies.sight(from.robot, radius + self.range, self.sees, robots);
        let axis = Vec2::unit(from.heading);
        for (ray, reading) in self.rays.iter().zip(reading) {
            let direction = ray.rotated(axis);
            let reach = radius + self.range;
            // Not from the rim, which overlaps by a hair what the robot leans on.
            if let Some(part) = sight.along(from.position, direction * reach) {
                *reading = 1.0 - (part * reach - radius).max(0.0) / self.range;
            }
        }
    }
}

pub(super) fn contact_sensor(config: &ContactSensorConfig, _: &World) -> ContactSensorConfig {
    config.clone()
}

/// 1 in each sector in which the robot touches something.
impl Sensor for ContactSensorConfig {
    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
        let Some(bodies) = surroundings.bodies else { return };
        let n_sectors = reading.len();
        for bump in bodies.bumps(from.robot) {
            let bearing = wrap_angle(bump.direction.angle() - from.heading);
            let sector = (bearing / TAU * n_sectors as f64).round() as usize % n_sectors;
            reading[sector] = 1.0;
        }
    }
}

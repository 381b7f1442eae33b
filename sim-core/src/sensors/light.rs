//! Light sensor: per sector the sum over the lights of its colour.

use super::{Decay, Noise, NoiseStream, Sensor, Surroundings, Viewpoint, take_sectors};
use crate::objects::StaticObjects;
use crate::torus::wrap_angle;
use crate::world::World;
use experiment_file::{BlockedBy, LightSensorConfig};

/// A light sensor and the lights that it can see. Readings per sector, in
/// \[0, 1\].
#[derive(Debug, Clone)]
pub(crate) struct LightSensor {
    decay: Decay,
    /// Largest angle between a sector's direction and a light that it sees, radians.
    aperture: f64,
    noise_deviation: f64,
    blocked_by: BlockedBy,
    /// Lights of its colour, each with the distance within which it is seen, cm.
    lights: Vec<(usize, f64)>,
}

/// A sensor for the lights of its colour.
pub(super) fn light_sensor(config: &LightSensorConfig, world: &World) -> LightSensor {
    let lights = StaticObjects::of_color(&world.lights, &config.color);
    LightSensor {
        decay: Decay { rho: config.decay_rho, phi: config.decay_phi },
        aperture: config.aperture,
        noise_deviation: config.noise_variance.sqrt(),
        blocked_by: config.blocked_by,
        lights: lights.map(|(light, range)| (light, range.min(config.range))).collect(),
    }
}

impl LightSensor {
    /// Whether nothing blocks the way of a light to a robot.
    fn shines_on(&self, light: usize, from: Viewpoint, surroundings: &Surroundings<'_>) -> bool {
        let light = surroundings.lights[light];
        surroundings.bodies.is_none_or(|bodies| {
            bodies.is_clear(from.position, light, self.blocked_by, &[from.robot])
        })
    }
}

impl Sensor for LightSensor {
    fn noise(&self) -> Noise {
        Noise { deviation: self.noise_deviation, stream: NoiseStream::LIGHT_AND_DISTANCE }
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
        let is_on = |&&(light, _): &&(usize, f64)| surroundings.switches.lights[light];
        for &(light, reach) in self.lights.iter().filter(is_on) {
            let away = surroundings.torus.displacement(from.position, surroundings.lights[light]);
            let rho = away.norm();
            if rho <= reach && self.shines_on(light, from, surroundings) {
                let bearing = wrap_angle(away.angle() - from.heading);
                take_sectors(rho, bearing, self.decay, self.aperture, reading, |sum, strength| {
                    sum + strength
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::neighbours::Neighbours;
    use crate::objects::Switches;
    use crate::swarm::Swarm;
    use crate::torus::{Torus, Vec2};

    const TORUS: Torus = Torus::new(1000.0, 1000.0);

    fn sense(lights: &[Vec2], reach: f64, heading: f64) -> Vec<f64> {
        sense_within(PI, lights, reach, heading)
    }

    fn sense_within(aperture: f64, lights: &[Vec2], reach: f64, heading: f64) -> Vec<f64> {
        let sensor = LightSensor {
            decay: Decay { rho: 0.05, phi: 1.0 },
            aperture,
            noise_deviation: 0.0,
            blocked_by: BlockedBy::Nothing,
            lights: (0..lights.len()).map(|light| (light, reach)).collect(),
        };
        let from = Viewpoint { robot: 0, position: Vec2::new(5.0, 5.0), heading };
        let neighbours = &Neighbours::new(0.0, 1);
        let switches = &Switches { lights: vec![true; lights.len()], areas: Vec::new() };
        let surroundings = Surroundings {
            torus: &TORUS,
            swarm: &Swarm::new(Vec::new(), Vec::new(), 0),
            neighbours,
            lights,
            areas: &[],
            switches,
            bodies: None,
        };
        let mut readings = vec![7.0; 4];
        sensor.sense(from, &surroundings, &mut readings);
        readings
    }

    fn assert_near(actual: &[f64], expected: &[f64]) {
        for (a, e) in actual.iter().zip(expected) {
            assert!((a - e).abs() < 1e-12, "{actual:?} {expected:?}");
        }
    }

    #[test]
    fn every_sector_sees_a_light_in_reach() {
        // The light is 40 cm to the left of a robot that looks along y, across the seam.
        let readings = sense(&[Vec2::new(965.0, 5.0)], 80.0, FRAC_PI_2);
        let strength = |phi: f64| libm::exp(-2.0 - phi);
        let expected = [FRAC_PI_2, 0.0, FRAC_PI_2, PI].map(strength);
        assert_near(&readings, &expected);
    }

    #[test]
    fn a_sector_sees_within_its_aperture() {
        let light = [Vec2::new(5.0, 45.0)];
        let seen = |aperture| {
            let readings = sense_within(aperture, &light, 80.0, 0.0);
            readings.iter().map(|&reading| reading > 0.0).collect::<Vec<_>>()
        };
        assert_eq!(seen(1.5), [false, true, false, false]);
        assert_eq!(seen(FRAC_PI_2), [true, true, true, false]);
        assert_eq!(seen(PI), [true; 4]);
    }

    #[test]
    fn lights_add_up() {
        let near = Vec2::new(6.0, 5.0);
        let far = Vec2::new(45.0, 5.0);
        let both = sense(&[near, far], 80.0, 0.0);
        assert_near(&both[..1], &[libm::exp(-0.05) + libm::exp(-2.0)]);
        let behind = libm::exp(-0.05 - PI) + libm::exp(-2.0 - PI);
        assert_near(&both[2..3], &[behind]);
    }

    #[test]
    fn out_of_reach_is_dark() {
        assert_eq!(sense(&[Vec2::new(86.0, 5.0)], 80.0, 0.0), [0.0; 4]);
        assert_ne!(sense(&[Vec2::new(85.0, 5.0)], 80.0, 0.0), [0.0; 4]);
        assert_eq!(sense(&[], 80.0, 0.0), [0.0; 4]);
    }
}

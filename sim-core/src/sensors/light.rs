//! Light sensor: per sector the sum over the lights of its colour.

use super::{Decay, Viewpoint, perturb};
use crate::torus::Vec2;
use numeric::random::Stream;

/// A light sensor and the lights that it can see.
#[derive(Debug, Clone)]
pub(crate) struct LightSensor {
    /// Sectors, n.
    pub n_sectors: usize,
    /// Fading.
    pub decay: Decay,
    /// Standard deviation of the noise.
    pub noise_deviation: f64,
    /// Lights of its colour, each with the distance within which it is seen, cm.
    pub lights: Vec<(usize, f64)>,
}

impl LightSensor {
    /// Readings per sector, in \[0, 1\]; `lights` are the positions of all lights.
    pub fn sense(
        &self,
        from: Viewpoint<'_>,
        lights: &[Vec2],
        noise: &mut Stream,
        readings: &mut [f64],
    ) {
        readings.fill(0.0);
        for &(light, reach) in &self.lights {
            from.view(lights[light], reach, self.decay, readings, |sum, strength| sum + strength);
        }
        perturb(readings, self.noise_deviation, noise);
    }

    /// Passes over the noise of one step.
    pub fn skip(&self, noise: &mut Stream) {
        if self.noise_deviation > 0.0 {
            noise.skip(self.n_sectors);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::torus::Torus;
    use numeric::random::Purpose;

    const TORUS: Torus = Torus { width: 1000.0, height: 1000.0 };

    fn sense(lights: &[Vec2], reach: f64, heading: f64) -> Vec<f64> {
        let sensor = LightSensor {
            n_sectors: 4,
            decay: Decay { rho: 0.05, phi: 1.0 },
            noise_deviation: 0.0,
            lights: (0..lights.len()).map(|light| (light, reach)).collect(),
        };
        let from = Viewpoint { torus: &TORUS, position: Vec2::new(5.0, 5.0), heading };
        let mut readings = vec![7.0; 4];
        let mut noise = Stream::new(0, 0, 0, Purpose::SensorNoise, 0);
        sensor.sense(from, lights, &mut noise, &mut readings);
        readings
    }

    fn assert_near(actual: &[f64], expected: &[f64]) {
        for (a, e) in actual.iter().zip(expected) {
            assert!((a - e).abs() < 1e-12, "{actual:?} {expected:?}");
        }
    }

    #[test]
    fn every_sector_sees_a_light_in_reach() {
        // 40 cm to the left of a robot that looks along y, across the seam.
        let readings = sense(&[Vec2::new(965.0, 5.0)], 80.0, FRAC_PI_2);
        let strength = |phi: f64| libm::exp(-2.0 - phi);
        let expected = [FRAC_PI_2, 0.0, FRAC_PI_2, PI].map(strength);
        assert_near(&readings, &expected);
    }

    #[test]
    fn lights_add_up_and_readings_are_clipped() {
        let near = Vec2::new(6.0, 5.0);
        let far = Vec2::new(45.0, 5.0);
        let both = sense(&[near, far], 80.0, 0.0);
        assert_eq!(both[0], 1.0);
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

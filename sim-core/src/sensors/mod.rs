//! Sensors beside the wireless receiver (section 3.2.2 of the thesis). Sector j of
//! n points to heading + j * 2 pi / n.

mod distance;
mod ground;
mod light;

pub(crate) use distance::DistanceSensor;
pub(crate) use ground::GroundSensor;
pub(crate) use light::LightSensor;

use crate::torus::{Torus, Vec2, angular_difference, sector_angle, wrap_angle};
use numeric::random::Stream;

/// How what a robot perceives fades with distance and angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Decay {
    /// Per cm.
    pub rho: f64,
    /// Per radian.
    pub phi: f64,
}

impl Decay {
    /// Strength, in (0, 1\], at distance `rho` and angle `phi` off the sector.
    pub fn strength(&self, rho: f64, phi: f64) -> f64 {
        libm::exp(self.loudness(rho, phi))
    }

    /// Logarithm of the strength.
    pub fn loudness(&self, rho: f64, phi: f64) -> f64 {
        -self.rho * rho - self.phi * phi
    }
}

/// The pose of a sensing robot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewpoint<'a> {
    /// The plane.
    pub torus: &'a Torus,
    /// Where the robot is.
    pub position: Vec2,
    /// Where it looks, in \[0, 2 pi).
    pub heading: f64,
}

impl Viewpoint<'_> {
    /// Hands each sector's strength of something at `target` to `take`, if it is
    /// within `reach`.
    fn view(
        &self,
        target: Vec2,
        reach: f64,
        decay: Decay,
        readings: &mut [f64],
        take: impl Fn(f64, f64) -> f64,
    ) {
        let away = self.torus.displacement(self.position, target);
        let rho = away.norm();
        if rho <= reach {
            let bearing = wrap_angle(away.angle() - self.heading);
            take_sectors(rho, bearing, decay, readings, take);
        }
    }
}

/// Hands each sector's strength of something at distance `rho` and in direction
/// `bearing`, in the robot's own frame, to `take`.
fn take_sectors(
    rho: f64,
    bearing: f64,
    decay: Decay,
    readings: &mut [f64],
    take: impl Fn(f64, f64) -> f64,
) {
    let n_sectors = readings.len();
    for (sector, reading) in readings.iter_mut().enumerate() {
        let phi = angular_difference(bearing, sector_angle(sector, n_sectors));
        *reading = take(*reading, decay.strength(rho, phi));
    }
}

/// Adds Gaussian noise to each reading, one draw each, and clips to \[0, 1\];
/// without noise nothing is drawn.
fn perturb(readings: &mut [f64], noise_deviation: f64, noise: &mut Stream) {
    for reading in readings {
        if noise_deviation > 0.0 {
            *reading += noise_deviation * noise.normal();
        }
        *reading = reading.clamp(0.0, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numeric::random::Purpose;

    #[test]
    fn noise_has_its_variance_and_readings_stay_in_range() {
        let mut noise = Stream::new(0, 0, 0, Purpose::SensorNoise, 0);
        let mut expected = noise.clone();
        let mut readings = [0.5, 0.9, 0.1, 0.0];
        perturb(&mut readings, 0.4, &mut noise);
        for (reading, clean) in readings.into_iter().zip([0.5, 0.9, 0.1, 0.0]) {
            assert_eq!(reading, (clean + 0.4 * expected.normal()).clamp(0.0, 1.0));
        }
    }

    #[test]
    fn without_noise_nothing_is_drawn() {
        let mut noise = Stream::new(0, 0, 0, Purpose::SensorNoise, 0);
        let untouched = noise.clone().uniform();
        let mut readings = [0.5, 1.7];
        perturb(&mut readings, 0.0, &mut noise);
        assert_eq!(readings, [0.5, 1.0]);
        assert_eq!(noise.uniform(), untouched);
    }
}

//! Distance sensor: per sector the nearness of the nearest robot.

use super::{Decay, perturb, take_sectors};
use crate::neighbours::Neighbour;
use crate::torus::wrap_angle;
use numeric::random::Stream;

/// A distance sensor.
#[derive(Debug, Clone)]
pub(crate) struct DistanceSensor {
    /// Sectors, n.
    pub n_sectors: usize,
    /// Reach, cm.
    pub range: f64,
    /// Fading.
    pub decay: Decay,
    /// Standard deviation of the noise.
    pub noise_deviation: f64,
}

impl DistanceSensor {
    /// Readings per sector, in \[0, 1\], of a robot with this heading.
    pub fn sense(
        &self,
        neighbours: &[Neighbour],
        heading: f64,
        noise: &mut Stream,
        readings: &mut [f64],
    ) {
        readings.fill(0.0);
        for neighbour in neighbours.iter().filter(|neighbour| neighbour.rho <= self.range) {
            let bearing = wrap_angle(neighbour.bearing - heading);
            take_sectors(neighbour.rho, bearing, self.decay, readings, f64::max);
        }
        perturb(readings, self.noise_deviation, noise);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::neighbours::Neighbours;
    use crate::torus::{Torus, Vec2};
    use numeric::random::Purpose;

    const TORUS: Torus = Torus { width: 1000.0, height: 1000.0 };

    fn sense(others: &[(f64, f64)]) -> Vec<f64> {
        let sensor = DistanceSensor {
            n_sectors: 4,
            range: 60.0,
            decay: Decay { rho: 0.05, phi: 1.0 },
            noise_deviation: 0.0,
        };
        let own = Vec2::new(990.0, 500.0);
        let mut robots: Vec<Vec2> = others.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        robots.insert(1, own);
        let mut neighbours = Neighbours::new(100.0, robots.len());
        neighbours.update(&TORUS, &robots);
        let mut readings = vec![7.0; 4];
        let mut noise = Stream::new(0, 0, 0, Purpose::SensorNoise, 0);
        sensor.sense(neighbours.of(1), 0.0, &mut noise, &mut readings);
        readings
    }

    #[test]
    fn each_sector_has_its_strongest_robot() {
        // One 20 cm ahead across the seam, one 50 cm to the left, one out of reach.
        let readings = sense(&[(10.0, 500.0), (990.0, 550.0), (900.0, 500.0)]);
        let strength = |rho: f64, phi: f64| libm::exp(-0.05 * rho - phi);
        let expected = [
            strength(20.0, 0.0),
            strength(50.0, 0.0).max(strength(20.0, FRAC_PI_2)),
            strength(20.0, PI).max(strength(50.0, FRAC_PI_2)),
            strength(20.0, FRAC_PI_2),
        ];
        for (reading, expected) in readings.iter().zip(expected) {
            assert!((reading - expected).abs() < 1e-12, "{readings:?} {expected:?}");
        }
    }

    #[test]
    fn a_robot_does_not_see_itself_but_one_on_top_of_it() {
        assert_eq!(sense(&[(500.0, 500.0)]), [0.0; 4]);
        assert_eq!(sense(&[(990.0, 500.0)])[0], 1.0);
    }
}

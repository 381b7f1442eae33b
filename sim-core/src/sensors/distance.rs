//! Distance sensor: per sector the nearness of the nearest robot.

use super::{Decay, Noise, NoiseStream, Sensor, Surroundings, Viewpoint, take_sectors};
use crate::torus::wrap_angle;
use experiment_file::DistanceSensorConfig;

/// A distance sensor. Readings per sector, in \[0, 1\].
#[derive(Debug, Clone)]
pub(crate) struct DistanceSensor {
    n_sectors: usize,
    /// Reach, cm.
    range: f64,
    decay: Decay,
    /// Largest angle off a sector's direction at which it sees, radians.
    aperture: f64,
    noise_deviation: f64,
}

impl DistanceSensor {
    /// As configured.
    pub fn new(config: &DistanceSensorConfig) -> Self {
        Self {
            n_sectors: config.n_sectors as usize,
            range: config.range,
            decay: Decay { rho: config.decay_rho, phi: config.decay_phi },
            aperture: config.aperture,
            noise_deviation: config.noise_variance.sqrt(),
        }
    }
}

impl Sensor for DistanceSensor {
    fn reading_len(&self) -> usize {
        self.n_sectors
    }

    fn noise(&self) -> Noise {
        Noise { deviation: self.noise_deviation, stream: NoiseStream::LIGHT_AND_DISTANCE }
    }

    fn robots_within(&self) -> f64 {
        self.range
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
        let neighbours = surroundings.neighbours.of_robot(from.robot);
        for neighbour in neighbours.filter(|neighbour| neighbour.rho <= self.range) {
            let bearing = wrap_angle(neighbour.bearing - from.heading);
            take_sectors(neighbour.rho, bearing, self.decay, self.aperture, reading, f64::max);
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

    const TORUS: Torus = Torus { width: 1000.0, height: 1000.0 };

    fn sense(others: &[(f64, f64)]) -> Vec<f64> {
        let sensor = DistanceSensor {
            n_sectors: 4,
            range: 60.0,
            decay: Decay { rho: 0.05, phi: 1.0 },
            aperture: PI,
            noise_deviation: 0.0,
        };
        let own = Vec2::new(990.0, 500.0);
        let mut robots: Vec<Vec2> = others.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        robots.insert(1, own);
        let mut neighbours = Neighbours::new(100.0, robots.len());
        neighbours.update(&TORUS, &robots);
        let mut readings = vec![7.0; 4];
        let from = Viewpoint { robot: 1, position: own, heading: 0.0 };
        let neighbours = &neighbours;
        let switches = &Switches { lights: Vec::new(), areas: Vec::new() };
        let surroundings = Surroundings {
            torus: &TORUS,
            swarm: &Swarm::new(Vec::new(), Vec::new(), 0),
            neighbours,
            lights: &[],
            areas: &[],
            switches,
        };
        sensor.sense(from, &surroundings, &mut readings);
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

//! Sensors of other robots: their nearness per sector, and positions and headings of the nearest.

use std::ops::RangeInclusive;

use super::{Decay, Noise, NoiseStream, Sensor, Surroundings, Viewpoint, take_sectors};
use crate::neighbours::Neighbour;
use crate::torus::wrap_angle;
use crate::world::World;
use experiment_file::{DistanceSensorConfig, NeighborhoodSensorConfig};

pub(super) fn distance_sensor(config: &DistanceSensorConfig, _: &World) -> DistanceSensorConfig {
    config.clone()
}

/// Per sector the nearness of the nearest robot, in \[0, 1\].
impl Sensor for DistanceSensorConfig {
    fn noise(&self) -> Noise {
        let deviation = self.noise_variance.sqrt();
        Noise { deviation, stream: NoiseStream::LIGHT_AND_DISTANCE }
    }

    fn robots_within(&self) -> f64 {
        self.range
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        reading.fill(0.0);
        let decay = Decay { rho: self.decay_rho, phi: self.decay_phi };
        // A line of sight costs more than the distance.
        let is_seen = |neighbour: &Neighbour| {
            neighbour.rho <= self.range
                && surroundings.bodies.is_none_or(|bodies| {
                    let ends = [from.robot, neighbour.robot];
                    let to = surroundings.swarm.positions[neighbour.robot];
                    bodies.is_clear(from.position, to, self.blocked_by, &ends)
                })
        };
        let neighbours = surroundings.neighbours.of_robot(from.robot);
        for neighbour in neighbours.filter(is_seen) {
            let bearing = wrap_angle(neighbour.bearing - from.heading);
            take_sectors(neighbour.rho, bearing, decay, self.aperture, reading, f64::max);
        }
    }
}

/// Values per neighbour: x and y, cm, and heading, radians.
const PER_NEIGHBOUR: usize = 3;

pub(super) fn neighborhood_pos_sensor(
    config: &NeighborhoodSensorConfig,
    _: &World,
) -> NeighborhoodSensorConfig {
    config.clone()
}

/// Positions and headings, in the world's frame, of the nearest robots of all objects. The nearest
/// comes first; of equally near robots, the one with the lower number. Missing robots have zeros.
impl Sensor for NeighborhoodSensorConfig {
    fn value_range(&self) -> RangeInclusive<f64> {
        0.0..=f64::MAX
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        let Surroundings { torus, swarm, .. } = surroundings;
        let n = self.n_neighbors as usize;
        let is_seen = |&robot: &usize| robot != from.robot && !swarm.is_removed(robot);
        let others = (0..swarm.positions.len()).filter(is_seen);
        let mut others: Vec<(f64, usize)> = others
            .map(|robot| (torus.distance(from.position, swarm.positions[robot]), robot))
            .collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if others.len() > n {
            others.select_nth_unstable_by(n - 1, order);
            others.truncate(n);
        }
        others.sort_unstable_by(order);
        reading.fill(0.0);
        for (values, (_, robot)) in reading.chunks_exact_mut(PER_NEIGHBOUR).zip(others) {
            let position = swarm.positions[robot];
            values.copy_from_slice(&[position.x, position.y, swarm.headings[robot]]);
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

    fn sense(others: &[(f64, f64)]) -> Vec<f64> {
        let sensor = DistanceSensorConfig { noise_variance: 0.0, ..Default::default() };
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
            bodies: None,
        };
        sensor.sense(from, &surroundings, &mut readings);
        readings
    }

    #[test]
    fn each_sector_has_its_strongest_robot() {
        // The robots are 20 cm ahead across the seam, 50 cm to the left, and out of reach.
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
    fn a_robot_sees_another_one_on_top_of_it_but_not_itself() {
        assert_eq!(sense(&[(500.0, 500.0)]), [0.0; 4]);
        assert_eq!(sense(&[(990.0, 500.0)])[0], 1.0);
    }

    #[test]
    fn the_nearest_come_first_across_the_seam_and_nobody_is_zeros() {
        let torus = &Torus::new(1000.0, 1000.0);
        let places = [(5.0, 5.0), (60.0, 5.0), (985.0, 5.0), (5.0, 60.0), (500.0, 500.0)];
        let headings: Vec<f64> = (0..5).map(f64::from).collect();
        let read = |n_robots: usize, n_neighbors: u32| {
            let positions = places[..n_robots].iter().map(|&(x, y)| Vec2::new(x, y)).collect();
            let swarm = &Swarm::new(positions, headings[..n_robots].to_vec(), 0);
            let neighbours = &Neighbours::new(0.0, n_robots);
            let switches = &Switches { lights: Vec::new(), areas: Vec::new() };
            let surroundings = Surroundings {
                torus,
                swarm,
                neighbours,
                lights: &[],
                areas: &[],
                switches,
                bodies: None,
            };
            let from = Viewpoint { robot: 0, position: swarm.positions[0], heading: 0.0 };
            let sensor = NeighborhoodSensorConfig { n_neighbors };
            let mut reading = vec![7.0; PER_NEIGHBOUR * n_neighbors as usize];
            sensor.sense(from, &surroundings, &mut reading);
            reading
        };
        assert_eq!(read(5, 3), [985.0, 5.0, 2.0, 60.0, 5.0, 1.0, 5.0, 60.0, 3.0]);
        assert_eq!(read(2, 2), [60.0, 5.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(read(1, 1), [0.0; 3]);
    }
}

//! Where the nearest robots are and look, in the world's frame.

use std::ops::RangeInclusive;

use super::{Noise, Sensor, Surroundings, Viewpoint};
use experiment_file::NeighborhoodSensorConfig;

/// Values per neighbour: x and y, cm, and heading, radians.
const PER_NEIGHBOUR: usize = 3;

/// Position and heading of the `n` nearest robots of all objects, the nearest first, of equally
/// near ones the one with the lower number. Zeros where there are not so many.
#[derive(Debug, Clone)]
pub(crate) struct NeighborhoodSensor {
    n: usize,
}

impl NeighborhoodSensor {
    /// As configured.
    pub fn new(config: &NeighborhoodSensorConfig) -> Self {
        Self { n: config.n_neighbors as usize }
    }
}

impl Sensor for NeighborhoodSensor {
    fn reading_len(&self) -> usize {
        PER_NEIGHBOUR * self.n
    }

    fn value_range(&self) -> RangeInclusive<f64> {
        0.0..=f64::MAX
    }

    fn noise(&self) -> Noise {
        Noise::NONE
    }

    fn sense(&self, from: Viewpoint, surroundings: &Surroundings<'_>, reading: &mut [f64]) {
        let Surroundings { torus, swarm, .. } = surroundings;
        let others = (0..swarm.positions.len()).filter(|&robot| robot != from.robot);
        let mut others: Vec<(f64, usize)> = others
            .map(|robot| (torus.distance(from.position, swarm.positions[robot]), robot))
            .collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if others.len() > self.n {
            others.select_nth_unstable_by(self.n - 1, order);
            others.truncate(self.n);
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
    use super::*;
    use crate::neighbours::Neighbours;
    use crate::objects::Switches;
    use crate::swarm::Swarm;
    use crate::torus::{Torus, Vec2};

    #[test]
    fn the_nearest_come_first_across_the_seam_and_nobody_is_zeros() {
        let torus = &Torus { width: 1000.0, height: 1000.0 };
        let places = [(5.0, 5.0), (60.0, 5.0), (985.0, 5.0), (5.0, 60.0), (500.0, 500.0)];
        let headings: Vec<f64> = (0..5).map(f64::from).collect();
        let read = |n_robots: usize, n: usize| {
            let positions = places[..n_robots].iter().map(|&(x, y)| Vec2::new(x, y)).collect();
            let swarm = &Swarm::new(positions, headings[..n_robots].to_vec(), 0);
            let neighbours = &Neighbours::new(0.0, n_robots);
            let switches = &Switches { lights: Vec::new(), areas: Vec::new() };
            let surroundings =
                Surroundings { torus, swarm, neighbours, lights: &[], areas: &[], switches };
            let from = Viewpoint { robot: 0, position: swarm.positions[0], heading: 0.0 };
            let mut reading = vec![7.0; 3 * n];
            NeighborhoodSensor { n }.sense(from, &surroundings, &mut reading);
            reading
        };
        assert_eq!(read(5, 3), [985.0, 5.0, 2.0, 60.0, 5.0, 1.0, 5.0, 60.0, 3.0]);
        assert_eq!(read(2, 2), [60.0, 5.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(read(1, 1), [0.0; 3]);
    }
}

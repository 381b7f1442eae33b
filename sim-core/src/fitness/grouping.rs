//! `grouping`: robots gather, but not on top of each other.

use super::{Definition, Fitness, Moment, mean};
use crate::record::Measures;
use experiment_file::FitnessFunction;

/// Distance to the centroid from which on a robot contributes 0, cm.
const FAR: f64 = 100.0;
/// Distance between two robots up to which the step has fitness 0, cm.
const CROWDED: f64 = 20.0;

/// The function of this file.
pub(super) const DEFINITIONS: &[Definition] = &[Definition {
    function: FitnessFunction::Grouping,
    measures: &["center_distance"],
    start: |_, _| Box::new(Grouping),
}];

/// f = mean clip(1 - distance to centroid / 100, 0, 1), or 0 if two robots are
/// within 20 cm of each other.
#[derive(Debug)]
pub(super) struct Grouping;

impl Fitness for Grouping {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        let torus = moment.torus;
        for (robot, &a) in moment.positions.iter().enumerate() {
            if moment.positions[..robot].iter().any(|&b| torus.distance(a, b) <= CROWDED) {
                return Some(0.0);
            }
        }
        let centroid = torus.centroid(moment.positions);
        let nearness = |&robot| (1.0 - torus.distance(robot, centroid) / FAR).clamp(0.0, 1.0);
        Some(mean(moment.positions.iter().map(nearness)))
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        let centroid = moment.torus.centroid(moment.positions);
        let distances =
            moment.positions.iter().map(|&robot| moment.torus.distance(robot, centroid));
        measures.insert("center_distance".into(), mean(distances));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitness::measures;
    use crate::torus::Vec2;

    fn fitness(positions: &[(f64, f64)]) -> f64 {
        let positions: Vec<Vec2> = positions.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        Grouping.step(&Moment { positions: &positions, ..Moment::EMPTY }).unwrap()
    }

    #[test]
    fn nearness_to_the_centroid_counts() {
        assert!((fitness(&[(980.0, 0.0), (20.0, 0.0)]) - 0.8).abs() < 1e-12);
        // The centroid is at x = 60, and the distances are 60, 10, 50 and 120.
        let far = fitness(&[(0.0, 0.0), (50.0, 0.0), (10.0, 0.0), (180.0, 0.0)]);
        assert_eq!(far, 0.0, "10 cm apart");
        let spread = fitness(&[(0.0, 0.0), (50.0, 0.0), (25.0, 0.0), (165.0, 0.0)]);
        assert!((spread - (0.4 + 0.9 + 0.65 + 0.0) / 4.0).abs() < 1e-12);
    }

    #[test]
    fn crowds_earn_nothing() {
        assert_eq!(fitness(&[(0.0, 0.0), (20.0, 0.0)]), 0.0);
        assert!(fitness(&[(0.0, 0.0), (20.1, 0.0)]) > 0.8);
    }

    #[test]
    fn one_robot_is_a_group() {
        assert_eq!(fitness(&[(123.0, 456.0)]), 1.0);
    }

    #[test]
    fn the_distance_to_the_centre_is_measured() {
        let positions = [Vec2::new(990.0, 0.0), Vec2::new(10.0, 0.0)];
        let moment = Moment { positions: &positions, ..Moment::EMPTY };
        assert_eq!(measures(&mut Grouping, &moment), [("center_distance", 10.0)]);
    }
}

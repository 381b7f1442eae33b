//! Experiment C: robots look in the same direction and keep still.

use std::f64::consts::PI;

use super::{Definition, Fitness, Moment, mean};
use crate::record::Measures;
use crate::torus::{Vec2, angular_difference, wrap_angle};
use experiment_file::{ALIGNMENT_SETTLING_STEPS, FitnessFunction};

/// The functions of this file, which share their measures.
pub(super) const DEFINITIONS: &[Definition] = &[
    Definition {
        function: FitnessFunction::OrientationConsensus,
        measures: &["misalignment", "turning"],
        start: |_, _| Box::new(OrientationConsensus),
    },
    Definition {
        function: FitnessFunction::Alignment,
        measures: &["misalignment", "turning"],
        start: |_, _| Box::new(Alignment),
    },
];

/// Spread of headings at which `alignment` is 0, radians.
const MAX_SPREAD: f64 = 0.4 * PI;

/// `orientation_consensus` (Eq. 5.5): (1 - mean misalignment / pi) * (1 - mean
/// |right wheel|).
#[derive(Debug)]
pub(super) struct OrientationConsensus;

impl Fitness for OrientationConsensus {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        let calm = 1.0 - turning(moment.wheels);
        Some((1.0 - misalignment(moment.headings) / PI) * calm)
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        measure(moment, measures);
    }
}

fn measure(moment: &Moment<'_>, measures: &mut Measures) {
    measures.insert("misalignment".into(), misalignment(moment.headings));
    measures.insert("turning".into(), turning(moment.wheels));
}

/// Mean |right wheel|, for robots that only turn in place.
fn turning(wheels: &[[f64; 2]]) -> f64 {
    mean(wheels.iter().map(|[right, _]| right.abs()))
}

/// Mean distance of headings to their circular mean, radians in \[0, pi\] (Eq. 6.2).
/// Headings that cancel out have the mean 0.
fn misalignment(headings: &[f64]) -> f64 {
    let sum = headings.iter().fold(Vec2::default(), |sum, &heading| {
        let direction = Vec2::unit(heading);
        Vec2 { x: sum.x + direction.x, y: sum.y + direction.y }
    });
    let center = sum.angle();
    mean(headings.iter().map(|&heading| angular_difference(heading, center)))
}

/// `alignment`, as in SpikeSwarmSim: with E the largest difference of two
/// headings, clip(1 - E / (0.4 pi), 0, 1) * mean clip(1 - |right wheel|, 0, 1).
#[derive(Debug)]
pub(super) struct Alignment;

impl Fitness for Alignment {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        if moment.step < ALIGNMENT_SETTLING_STEPS {
            return None;
        }
        let aligned = (1.0 - spread(moment.headings) / MAX_SPREAD).clamp(0.0, 1.0);
        let calm = mean(moment.wheels.iter().map(|[right, _]| (1.0 - right.abs()).clamp(0.0, 1.0)));
        Some(aligned * calm)
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        measure(moment, measures);
    }
}

/// The largest difference of two headings if it is below `MAX_SPREAD`, otherwise any larger
/// number.
fn spread(headings: &[f64]) -> f64 {
    let Some(&first) = headings.first() else { return 0.0 };
    let (mut least, mut most) = (0.0, 0.0);
    for &heading in headings {
        // The shortest difference, in [-pi, pi].
        let turn = wrap_angle(heading - first + PI) - PI;
        if turn.abs() >= MAX_SPREAD {
            return MAX_SPREAD;
        }
        least = f64::min(least, turn);
        most = f64::max(most, turn);
    }
    // If all headings are near the first one, no difference wraps around the circle.
    most - least
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;
    use crate::fitness::measures;

    fn moment<'a>(headings: &'a [f64], wheels: &'a [[f64; 2]], step: u32) -> Moment<'a> {
        Moment { headings, wheels, step, ..Moment::EMPTY }
    }

    fn consensus(headings: &[f64], wheels: &[[f64; 2]]) -> f64 {
        OrientationConsensus.step(&moment(headings, wheels, 0)).unwrap()
    }

    fn alignment(headings: &[f64], wheels: &[[f64; 2]]) -> f64 {
        Alignment.step(&moment(headings, wheels, 100)).unwrap()
    }

    #[test]
    fn the_mean_heading_is_circular() {
        // Around 0 = 2 pi.
        assert!((misalignment(&[0.1, TAU - 0.1]) - 0.1).abs() < 1e-12);
        assert!((misalignment(&[3.0, 3.0, 3.3]) - 0.4 / 3.0).abs() < 1e-3);
        assert_eq!(misalignment(&[1.5]), 0.0);
        assert_eq!(misalignment(&[]), 0.0);
    }

    #[test]
    fn misalignment_is_measured_from_the_first_step_on() {
        let moment = moment(&[0.0, PI / 2.0], &[[0.5, -0.5], [-0.3, 0.3]], 0);
        for fitness in [&mut OrientationConsensus as &mut dyn Fitness, &mut Alignment] {
            let measures = measures(fitness, &moment);
            assert_eq!(measures.len(), 2);
            assert_eq!(measures[0].0, "misalignment");
            assert!((measures[0].1 - PI / 4.0).abs() < 1e-12);
            assert_eq!(measures[1], ("turning", 0.4));
        }
    }

    #[test]
    fn consensus_matches_cases_by_hand() {
        let still = [[0.0; 2]; 2];
        assert!((consensus(&[6.2, 6.2], &still) - 1.0).abs() < 1e-12);
        assert!((consensus(&[0.0, PI / 2.0], &still) - 0.75).abs() < 1e-12);
        let turning = [[0.5, -0.5], [-0.3, 0.3]];
        assert!((consensus(&[0.0, PI / 2.0], &turning) - 0.75 * 0.6).abs() < 1e-12);
    }

    #[test]
    fn alignment_matches_cases_by_hand() {
        let wheels = [[0.5, -0.5], [-0.3, 0.3], [0.0, 0.0]];
        let calm = 1.0 - 0.8 / 3.0;
        let spread = alignment(&[0.1 * PI, 0.0, TAU - 0.1 * PI], &wheels);
        assert!((spread - 0.5 * calm).abs() < 1e-12);
        assert_eq!(alignment(&[0.0, 0.5 * PI, 0.0], &wheels), 0.0);
        assert!((alignment(&[1.0], &[[0.0; 2]]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn alignment_does_not_count_the_first_steps() {
        assert_eq!(Alignment.step(&moment(&[0.0], &[[0.0; 2]], 99)), None);
    }

    proptest! {
        #[test]
        fn turning_the_whole_swarm_changes_nothing(
            headings in prop::collection::vec(0.0..TAU, 1..10), turn in 0.0..TAU,
        ) {
            let turned: Vec<f64> = headings.iter().map(|h| wrap_angle(h + turn)).collect();
            let still = vec![[0.0; 2]; headings.len()];
            prop_assert!((alignment(&headings, &still) - alignment(&turned, &still)).abs() < 1e-9);
            let (a, b) = (consensus(&headings, &still), consensus(&turned, &still));
            prop_assert!((a - b).abs() < 1e-6, "{} {}", a, b);
            prop_assert!((0.0..=1.0).contains(&a));
        }
    }
}

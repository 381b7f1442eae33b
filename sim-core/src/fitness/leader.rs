//! `identify_leader` (Eq. 5.2 and 5.3): exactly one robot leads, and always the same.

use super::{Definition, Fitness, Moment};
use crate::leadership::Leadership;
use crate::record::Measures;
use experiment_file::FitnessFunction;

/// Weight of a leader's experience per step.
const WEIGHT: f64 = 0.1;
/// Largest fitness of a step.
const MAX: f64 = 5.0;

/// The function of this file.
pub(super) const DEFINITIONS: &[Definition] = &[Definition {
    function: FitnessFunction::IdentifyLeader,
    measures: &["leaders", "one_leader"],
    start: |_, _| Box::new(IdentifyLeader::default()),
}];

/// f = min(0.1 c, 5) with exactly one leader, otherwise 0. c is the number of directly preceding
/// steps in which the same robot was the sole leader.
#[derive(Debug, Default)]
pub(super) struct IdentifyLeader {
    leadership: Leadership,
}

impl Fitness for IdentifyLeader {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        let leader = self.leadership.observe(moment.leds);
        Some(leader.map_or(0.0, |leader| (WEIGHT * f64::from(leader.n_steps - 1)).min(MAX)))
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        let n_leaders = moment.leds.iter().filter(|&&led| led > 0).count();
        measures.insert("leaders".into(), n_leaders as f64);
        measures.insert("one_leader".into(), f64::from(self.leadership.has_leader()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fitness::measures;

    fn mean(steps: impl Iterator<Item = [u32; 3]>) -> f64 {
        let mut fitness = IdentifyLeader::default();
        let values: Vec<f64> = steps
            .map(|leds| fitness.step(&Moment { leds: &leds, ..Moment::EMPTY }).unwrap())
            .collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn one_leader_for_50_steps_gives_the_optimum() {
        assert!((mean((0..50).map(|_| [0, 1, 0])) - 2.45).abs() < 1e-12);
    }

    #[test]
    fn a_leader_earns_at_most_five() {
        let late = mean((0..1000).map(|_| [0, 1, 0]));
        assert!((late - (50.0 * 2.45 + 950.0 * 5.0) / 1000.0).abs() < 1e-9);
    }

    #[test]
    fn a_leader_that_changes_several_leaders_and_no_leader_earn_nothing() {
        assert_eq!(mean((0..50).map(|k| [k % 2, (k + 1) % 2, 0])), 0.0);
        assert_eq!(mean((0..50).map(|_| [1, 1, 0])), 0.0);
        assert_eq!(mean((0..50).map(|_| [0, 0, 0])), 0.0);
    }

    #[test]
    fn measures_distinguish_one_leader_from_none_and_several() {
        let mut fitness = IdentifyLeader::default();
        for (leds, n, expected) in
            [([0, 0], 0.0, 0.0), ([0, 1], 1.0, 1.0), ([2, 0], 1.0, 1.0), ([1, 1], 2.0, 0.0)]
        {
            let moment = Moment { leds: &leds, ..Moment::EMPTY };
            let expected = [("leaders", n), ("one_leader", expected)];
            assert_eq!(measures(&mut fitness, &moment), expected);
        }
    }
}

//! `identify_borderline` (Eq. 5.4): robots at the swarm's border, and only they,
//! have their LED on.

use super::{Definition, Fitness, Moment};
use crate::border;
use crate::record::Measures;
use experiment_file::FitnessFunction;

/// The function of this file.
pub(super) const DEFINITIONS: &[Definition] = &[Definition {
    function: FitnessFunction::IdentifyBorderline,
    measures: &["true_positive_rate", "true_negative_rate", "precision", "accuracy"],
    start: |world, params| {
        Box::new(IdentifyBorderline::new(world.communication_range(), params.alpha))
    },
}];

/// f = TPR * TNR; only TPR if no robot is in the interior.
#[derive(Debug)]
pub(super) struct IdentifyBorderline {
    range: f64,
    alpha: f64,
    /// Whether each robot is at the border.
    targets: Vec<bool>,
}

impl IdentifyBorderline {
    /// Robots less than `range` apart are connected. `alpha`: the parameter of their alpha shape.
    pub fn new(range: f64, alpha: f64) -> Self {
        Self { range, alpha, targets: Vec::new() }
    }
}

impl Fitness for IdentifyBorderline {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        if moment.moved || self.targets.is_empty() {
            self.targets = border::of_swarm(moment.torus, moment.positions, self.range, self.alpha);
        }
        let rates = Rates::new(&self.targets, moment.leds);
        Some(rates.true_positive * rates.true_negative)
    }

    fn measure(&self, moment: &Moment<'_>, measures: &mut Measures) {
        let rates = Rates::new(&self.targets, moment.leds);
        measures.insert("true_positive_rate".into(), rates.true_positive);
        measures.insert("true_negative_rate".into(), rates.true_negative);
        if let Some(precision) = rates.precision {
            measures.insert("precision".into(), precision);
        }
        measures.insert("accuracy".into(), rates.accuracy);
    }

    fn targets(&self) -> &[bool] {
        &self.targets
    }
}

/// Shares of robots with the right LED.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rates {
    /// Share of border robots with the LED on.
    true_positive: f64,
    /// Share of interior robots with the LED off; 1 without any.
    true_negative: f64,
    /// Share of robots with the LED on that are at the border; `None` if no LED is on.
    precision: Option<f64>,
    /// Share of all robots with the right LED.
    accuracy: f64,
}

impl Rates {
    /// Compares LEDs with the robots' places.
    fn new(at_border: &[bool], leds: &[u32]) -> Self {
        // Returns the number of robots at this place with the right LED, and of all robots at this
        // place.
        let count = |place: bool| {
            let robots = at_border.iter().zip(leds).filter(|(at_border, _)| **at_border == place);
            let right = robots.clone().filter(|(_, led)| (**led > 0) == place).count();
            (right, robots.count())
        };
        let share = |right: usize, all: usize| {
            if all == 0 { 1.0 } else { right as f64 / all as f64 }
        };
        let (positive, negative) = (count(true), count(false));
        let n_on = leds.iter().filter(|&&led| led > 0).count();
        Self {
            precision: (n_on > 0).then(|| share(positive.0, n_on)),
            true_positive: share(positive.0, positive.1),
            true_negative: share(negative.0, negative.1),
            accuracy: share(positive.0 + negative.0, positive.1 + negative.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::fitness::measures;
    use crate::torus::Vec2;

    const SQUARE: [Vec2; 5] = [
        Vec2::new(0.0, 0.0),
        Vec2::new(80.0, 0.0),
        Vec2::new(80.0, 80.0),
        Vec2::new(0.0, 80.0),
        Vec2::new(41.0, 40.0),
    ];

    fn fitness(positions: &[Vec2], leds: &[u32]) -> f64 {
        let moment = Moment { positions, leds, ..Moment::EMPTY };
        IdentifyBorderline::new(100.0, 15.0).step(&moment).unwrap()
    }

    #[test]
    fn fitness_is_the_product_of_the_rates() {
        assert_eq!(fitness(&SQUARE, &[1, 1, 1, 1, 0]), 1.0);
        assert_eq!(fitness(&SQUARE, &[1, 2, 0, 1, 0]), 0.75);
        assert_eq!(fitness(&SQUARE, &[1, 1, 1, 1, 1]), 0.0);
        assert_eq!(fitness(&SQUARE, &[0, 0, 0, 0, 0]), 0.0);
    }

    #[test]
    fn without_interior_the_true_positive_rate_decides() {
        assert_eq!(fitness(&SQUARE[..4], &[1, 0, 0, 1]), 0.5);
        assert_eq!(fitness(&SQUARE[..1], &[1]), 1.0);
    }

    #[test]
    fn targets_follow_robots_that_move() {
        let mut fitness = IdentifyBorderline::new(100.0, 15.0);
        let leds = &[1, 1, 1, 1, 0];
        let mut moment = Moment { positions: &SQUARE, leds, ..Moment::EMPTY };
        assert_eq!(fitness.step(&moment), Some(1.0));
        let mut away = SQUARE;
        away[4] = Vec2::new(500.0, 500.0);
        moment.positions = &away;
        moment.moved = false;
        assert_eq!(fitness.step(&moment), Some(1.0), "the moment states that no robot moved");
        moment.moved = true;
        assert_eq!(fitness.step(&moment), Some(0.8));
    }

    #[test]
    fn accuracy_counts_all_robots() {
        let rates = Rates::new(&[true, true, false, false, false], &[1, 0, 0, 0, 1]);
        let expected = Rates {
            true_positive: 0.5,
            true_negative: 2.0 / 3.0,
            precision: Some(0.5),
            accuracy: 0.6,
        };
        assert_eq!(rates, expected);
        assert_eq!(Rates::new(&[true, false], &[0, 0]).precision, None);
    }

    proptest! {
        /// Accuracy is the mean of both rates, weighted with the numbers of robots at each place.
        /// The robots at the border with their LED on are counted alike by precision and by the
        /// true positive rate.
        #[test]
        fn rates_agree_with_each_other(robots in prop::collection::vec((any::<bool>(), 0..3_u32), 1..40)) {
            let (at_border, leds): (Vec<bool>, Vec<u32>) = robots.into_iter().unzip();
            let Rates { true_positive, true_negative, precision, accuracy } =
                Rates::new(&at_border, &leds);
            let n = at_border.len() as f64;
            let n_border = at_border.iter().filter(|is| **is).count() as f64;
            let n_on = leds.iter().filter(|led| **led > 0).count() as f64;
            let right = true_positive * n_border + true_negative * (n - n_border);
            prop_assert!((accuracy * n - right).abs() < 1e-9);
            let n_true_positives = if n_border > 0.0 { true_positive * n_border } else { 0.0 };
            prop_assert!((precision.unwrap_or(0.0) * n_on - n_true_positives).abs() < 1e-9);
        }
    }

    #[test]
    fn the_rates_are_measured() {
        let moment = Moment { positions: &SQUARE, leds: &[1, 1, 0, 0, 0], ..Moment::EMPTY };
        let expected = [
            ("true_positive_rate", 0.5),
            ("true_negative_rate", 1.0),
            ("precision", 1.0),
            ("accuracy", 0.6),
        ];
        assert_eq!(measures(&mut IdentifyBorderline::new(100.0, 15.0), &moment), expected);
    }
}

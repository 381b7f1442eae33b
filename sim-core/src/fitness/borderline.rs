//! `identify_borderline` (Eq. 5.4): robots at the swarm's border, and only they,
//! have their LED on.

use super::{Fitness, Moment};
use crate::border;

/// f = TPR * TNR; just TPR if no robot is in the interior.
#[derive(Debug)]
pub(super) struct IdentifyBorderline {
    range: f64,
    /// Who is at the border.
    targets: Vec<bool>,
}

impl IdentifyBorderline {
    /// Robots less than `range` apart are connected.
    pub fn new(range: f64) -> Self {
        Self { range, targets: Vec::new() }
    }
}

impl Fitness for IdentifyBorderline {
    fn step(&mut self, moment: &Moment<'_>) -> Option<f64> {
        if moment.moved || self.targets.is_empty() {
            self.targets = border::of_swarm(moment.torus, moment.positions, self.range);
        }
        Some(rates(&self.targets, moment.leds).fitness())
    }
}

/// Shares of robots that know their place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rates {
    /// Share of border robots with the LED on.
    pub true_positive: f64,
    /// Share of interior robots with the LED off; 1 without any.
    pub true_negative: f64,
    /// Share of all robots that are right.
    pub accuracy: f64,
}

impl Rates {
    fn fitness(self) -> f64 {
        self.true_positive * self.true_negative
    }
}

/// Compares LEDs with the robots' places.
pub(crate) fn rates(at_border: &[bool], leds: &[u32]) -> Rates {
    // Robots at the place, and those of them whose LED says so.
    let count = |place: bool| {
        let robots = at_border.iter().zip(leds).filter(|(at_border, _)| **at_border == place);
        let right = robots.clone().filter(|(_, led)| (**led > 0) == place).count();
        (right, robots.count())
    };
    let share = |(right, all): (usize, usize)| {
        if all == 0 { 1.0 } else { right as f64 / all as f64 }
    };
    let (positive, negative) = (count(true), count(false));
    Rates {
        true_positive: share(positive),
        true_negative: share(negative),
        accuracy: share((positive.0 + negative.0, positive.1 + negative.1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
        IdentifyBorderline::new(100.0).step(&moment).unwrap()
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
        let mut fitness = IdentifyBorderline::new(100.0);
        let leds = &[1, 1, 1, 1, 0];
        let mut moment = Moment { positions: &SQUARE, leds, ..Moment::EMPTY };
        assert_eq!(fitness.step(&moment), Some(1.0));
        let mut away = SQUARE;
        away[4] = Vec2::new(500.0, 500.0);
        moment.positions = &away;
        moment.moved = false;
        assert_eq!(fitness.step(&moment), Some(1.0), "said not to have moved");
        moment.moved = true;
        assert_eq!(fitness.step(&moment), Some(0.8));
    }

    #[test]
    fn accuracy_counts_all_robots() {
        let rates = rates(&[true, true, false, false, false], &[1, 0, 0, 0, 1]);
        assert_eq!(rates.true_positive, 0.5);
        assert_eq!(rates.true_negative, 2.0 / 3.0);
        assert_eq!(rates.accuracy, 0.6);
    }
}

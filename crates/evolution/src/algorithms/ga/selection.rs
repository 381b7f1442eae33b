//! Selection operators, which choose parents.

use determinism::random::Stream;
use experiment_file::{Parameter, Params, limits};
use serde::{Deserialize, Serialize};

/// A selection operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Selection {
    /// The best of `size` individuals, drawn uniformly with replacement (Algorithm 1).
    Tournament {
        /// Number of contestants K.
        size: usize,
    },
    /// Proportional to fitness, independent draws.
    Roulette,
    /// Linear in rank (Baker 1985), with selection pressure 1.5.
    LinearRank,
    /// Geometric in rank (Michalewicz 1992), with ratio 0.9.
    NonlinearRank,
    /// Proportional to fitness, evenly spaced draws with one random offset (Baker 1987). Every
    /// individual is drawn as often as expected, up to less than one draw.
    StochasticUniversal,
}

/// Expected number of draws of the best individual by linear rank, relative to the average.
const LINEAR_PRESSURE: f64 = 1.5;
/// Weight q of the best individual by non-linear rank, before normalisation; each further rank
/// has 1 - q times the weight of the previous one.
const NONLINEAR_BEST: f64 = 0.1;

/// Chooses among the variants of [`Selection`], in their order.
pub const OPERATOR: Parameter = Parameter::one_of(
    "selection_operator",
    &["tournament", "roulette", "lin_rank", "nonlin_rank", "stochastic_universal"],
    &[],
    "How parents are chosen",
);
/// Number of contestants of a tournament, K.
pub const TOURNAMENT_SIZE: Parameter = Parameter::whole(
    "tournament_size",
    [1, limits::POPULATION],
    3,
    "Contestants of a tournament, drawn with replacement",
);

impl Selection {
    /// The configured operator.
    pub fn new(params: &Params) -> Self {
        match params.value_of::<String>(&OPERATOR).as_str() {
            "tournament" => {
                Self::Tournament { size: params.value_of::<u32>(&TOURNAMENT_SIZE) as usize }
            }
            "roulette" => Self::Roulette,
            "lin_rank" => Self::LinearRank,
            "nonlin_rank" => Self::NonlinearRank,
            "stochastic_universal" => Self::StochasticUniversal,
            other => unreachable!("`{other}` is none of the names in the domain"),
        }
    }

    /// Draws `n` parents, as ranks (0 is the best). `fitness`: finite, best first,
    /// not empty.
    pub fn select(self, n: usize, fitness: &[f64], rng: &mut Stream) -> Vec<usize> {
        match self {
            Self::Tournament { size } => {
                (0..n).map(|_| tournament(size, fitness.len(), rng)).collect()
            }
            Self::Roulette => Wheel::new(proportional(fitness)).spin(n, rng),
            Self::LinearRank => Wheel::new(linear(fitness.len())).spin(n, rng),
            Self::NonlinearRank => Wheel::new(geometric(fitness.len())).spin(n, rng),
            Self::StochasticUniversal => Wheel::new(proportional(fitness)).sweep(n, rng),
        }
    }
}

/// The smallest rank wins; ranks also decide between equal fitness.
fn tournament(size: usize, n: usize, rng: &mut Stream) -> usize {
    (1..size).fold(rng.below(n), |best, _| best.min(rng.below(n)))
}

/// Weights proportional to fitness: fitness itself if none is negative, otherwise fitness minus
/// the smallest. If all weights are 0, all individuals are equal.
fn proportional(fitness: &[f64]) -> Vec<f64> {
    // Halving and a common scale keep differences and sums from overflowing.
    let smallest = fitness[fitness.len() - 1];
    let shift = if smallest < 0.0 { smallest / 2.0 } else { 0.0 };
    let largest = fitness[0] / 2.0 - shift;
    if largest == 0.0 {
        return vec![1.0; fitness.len()];
    }
    fitness.iter().map(|f| (f / 2.0 - shift) / largest).collect()
}

/// s - (2s - 2) r/(n - 1) for rank r = 0..n, s the selection pressure.
fn linear(n: usize) -> Vec<f64> {
    let slope = 2.0 * (LINEAR_PRESSURE - 1.0) / (n.max(2) - 1) as f64;
    (0..n).map(|rank| LINEAR_PRESSURE - slope * rank as f64).collect()
}

/// q (1 - q)^r for rank r = 0..n.
fn geometric(n: usize) -> Vec<f64> {
    let mut weight = NONLINEAR_BEST;
    let mut weights = Vec::with_capacity(n);
    for _ in 0..n {
        weights.push(weight);
        weight *= 1.0 - NONLINEAR_BEST;
    }
    weights
}

/// A wheel of fortune: each rank has a sector as wide as its weight.
struct Wheel {
    /// Where the sectors end.
    ends: Vec<f64>,
}

impl Wheel {
    /// `weights`: not negative, not all 0.
    fn new(weights: Vec<f64>) -> Self {
        let mut end = 0.0;
        let ends = weights.into_iter().map(|weight| {
            end += weight;
            end
        });
        Self { ends: ends.collect() }
    }

    /// The rank at `position` in \[0, 1\] of the wheel's circumference.
    fn at(&self, position: f64) -> usize {
        let circumference = self.ends[self.ends.len() - 1];
        let target = (position * circumference).min(circumference.next_down());
        // Sectors are half-open, so an empty one is never hit.
        self.ends.partition_point(|&end| end <= target)
    }

    /// `n` independent positions.
    fn spin(&self, n: usize, rng: &mut Stream) -> Vec<usize> {
        (0..n).map(|_| self.at(rng.uniform())).collect()
    }

    /// `n` positions at equal distances.
    fn sweep(&self, n: usize, rng: &mut Stream) -> Vec<usize> {
        let offset = rng.uniform();
        (0..n).map(|k| self.at((k as f64 + offset) / n as f64)).collect()
    }
}

#[cfg(test)]
mod tests {
    use determinism::random::Purpose;

    use super::*;

    const N: usize = 10;

    fn rng() -> Stream {
        Stream::new(1, 0, 0, Purpose::Evolution, 0)
    }

    fn fitness() -> Vec<f64> {
        (0..N).map(|rank| (N - rank) as f64).collect()
    }

    /// Share of the draws that each rank gets.
    fn shares(selection: Selection, fitness: &[f64]) -> Vec<f64> {
        let n = 200_000;
        let mut shares = vec![0.0; fitness.len()];
        for rank in selection.select(n, fitness, &mut rng()) {
            shares[rank] += 1.0 / n as f64;
        }
        shares
    }

    /// Standard deviations of the shares are below 0.0012.
    fn assert_close(shares: &[f64], expected: impl Fn(usize) -> f64) {
        for (rank, share) in shares.iter().enumerate() {
            assert!((share - expected(rank)).abs() < 0.004, "{rank}: {share} {}", expected(rank));
        }
    }

    #[test]
    fn a_tournament_of_k_selects_by_the_kth_power_of_rank() {
        for size in [1, 2, 3, 5] {
            let not_better = |rank: usize| libm::pow((N - rank) as f64 / N as f64, size as f64);
            let shares = shares(Selection::Tournament { size }, &fitness());
            assert_close(&shares, |rank| not_better(rank) - not_better(rank + 1));
        }
    }

    #[test]
    fn roulette_selects_in_proportion_to_fitness() {
        assert_close(&shares(Selection::Roulette, &fitness()), |rank| (N - rank) as f64 / 55.0);
    }

    #[test]
    fn linear_rank_gives_the_best_its_pressure_and_falls_evenly() {
        let expected = |rank: usize| (1.5 - rank as f64 / (N - 1) as f64) / N as f64;
        assert_close(&shares(Selection::LinearRank, &fitness()), expected);
    }

    #[test]
    fn nonlinear_rank_falls_geometrically() {
        let sum: f64 = (0..N).map(|rank| libm::pow(0.9, rank as f64)).sum();
        let expected = |rank: usize| libm::pow(0.9, rank as f64) / sum;
        assert_close(&shares(Selection::NonlinearRank, &fitness()), expected);
    }

    #[test]
    fn stochastic_universal_differs_from_expectation_by_less_than_one() {
        let n = 37;
        let mut rng = rng();
        let mut offsets_matter = false;
        for _ in 0..100 {
            let selected = Selection::StochasticUniversal.select(n, &fitness(), &mut rng);
            for rank in 0..N {
                let expected = n as f64 * (N - rank) as f64 / 55.0;
                let count = selected.iter().filter(|&&r| r == rank).count() as f64;
                assert!((count - expected).abs() < 1.0, "{rank}: {count} {expected}");
                offsets_matter |= count > expected && rank == 0;
            }
        }
        assert!(offsets_matter);
        let shares = shares(Selection::StochasticUniversal, &fitness());
        assert_close(&shares, |rank| (N - rank) as f64 / 55.0);
    }

    #[test]
    fn negative_fitness_counts_from_the_worst() {
        for selection in [Selection::Roulette, Selection::StochasticUniversal] {
            let shares = shares(selection, &[2.0, 0.0, -2.0]);
            assert!((shares[0] - 2.0 / 3.0).abs() < 0.004, "{shares:?}");
            assert_eq!(shares[2], 0.0, "the worst has no share");
        }
    }

    #[test]
    fn parents_can_be_selected_by_equal_or_extreme_fitness() {
        for selection in [Selection::Roulette, Selection::StochasticUniversal] {
            for equal in [0.0, -3.0, 7.0, -0.0] {
                assert_close(&shares(selection, &[equal; 4]), |_| 0.25);
            }
            let huge = shares(selection, &[f64::MAX, 0.0, -f64::MAX]);
            assert!((huge[0] - 2.0 / 3.0).abs() < 0.004, "{huge:?}");
            assert_close(&shares(selection, &[f64::MIN_POSITIVE; 4]), |_| 0.25);
            assert!((shares(selection, &[1.0])[0] - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn individuals_without_a_share_are_never_drawn() {
        let wheel = Wheel::new(vec![0.0, 1.0, 0.0, 2.0, 0.0]);
        let hits: Vec<usize> = [0.0, 0.1, 0.333, 0.334, 1.0].map(|p| wheel.at(p)).to_vec();
        assert_eq!(hits, [1, 1, 1, 3, 3]);
    }
}

//! Crossover operators, which make two children of two parents.

use determinism::random::Stream;
use experiment_file::{Parameter, Params};
use serde::{Deserialize, Serialize};

use crate::Genotype;

/// A crossover operator, which makes two children of two parents.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Crossover {
    /// BLX-alpha (Eshelman, Schaffer 1993): each gene of each child uniform on
    /// \[min - alpha |a - b|, max + alpha |a - b|\].
    BlxAlpha {
        /// Reach beyond the parents, relative to their distance.
        alpha: f64,
    },
    /// Each gene goes to either child (Syswerda 1989).
    Uniform,
    /// The parents swap all genes after a random cut (Holland 1975).
    OnePoint,
    /// The parents swap every other piece between three random cuts (De Jong
    /// 1975).
    MultiPoint,
    /// Simulated binary crossover (Deb, Agrawal 1995), every gene crossed.
    SimulatedBinary,
}

/// Number of cuts in multi-point crossover; fewer if there are fewer places.
const N_CUTS: usize = 3;
/// Distribution index of simulated binary crossover. A larger index keeps children closer to their
/// parents.
const SBX_INDEX: f64 = 0.5;

/// Chooses among the variants of [`Crossover`], in their order.
pub const OPERATOR: Parameter = Parameter::one_of(
    "crossover_operator",
    &["blxalpha", "uniform", "onepoint", "multipoint", "simulated_binary", "combination"],
    &["pcx"],
    "How two parents yield two children",
);
/// The reach of BLX-alpha beyond the parents.
pub const ALPHA: Parameter = Parameter::amount(
    "alpha",
    0.5,
    "How far `blxalpha` and `combination` reach beyond the parents",
);

impl Crossover {
    /// The configured operator.
    pub fn new(params: &Params) -> Self {
        match params.value_of::<String>(&OPERATOR).as_str() {
            // SpikeSwarmSim has two names for this operator.
            "blxalpha" | "combination" => Self::BlxAlpha { alpha: params.value_of(&ALPHA) },
            "uniform" => Self::Uniform,
            "onepoint" => Self::OnePoint,
            "multipoint" => Self::MultiPoint,
            "simulated_binary" => Self::SimulatedBinary,
            other => unreachable!("`{other}` is none of the names in the domain"),
        }
    }

    /// The children of `a` and `b`; their genes may lie outside \[0, 1\].
    pub fn cross(self, a: &[f64], b: &[f64], rng: &mut Stream) -> [Genotype; 2] {
        match self {
            Self::BlxAlpha { alpha } => [(); 2].map(|()| blx_alpha(alpha, a, b, rng)),
            Self::Uniform => swap_where(a, b, |_| rng.bernoulli(0.5)),
            Self::OnePoint => swap_between(a, b, &cuts(1, a.len(), rng)),
            Self::MultiPoint => swap_between(a, b, &cuts(N_CUTS, a.len(), rng)),
            Self::SimulatedBinary => simulated_binary(a, b, rng),
        }
    }
}

fn blx_alpha(alpha: f64, a: &[f64], b: &[f64], rng: &mut Stream) -> Genotype {
    let gene = |(a, b): (&f64, &f64)| {
        let reach = alpha * (a - b).abs();
        let (low, high) = (a.min(*b) - reach, a.max(*b) + reach);
        low + (high - low) * rng.uniform()
    };
    a.iter().zip(b).map(gene).collect()
}

/// Copies of the parents, with their genes swapped where `is_swapped` is true.
fn swap_where(a: &[f64], b: &[f64], mut is_swapped: impl FnMut(usize) -> bool) -> [Genotype; 2] {
    let (mut x, mut y) = (a.to_vec(), b.to_vec());
    for j in 0..x.len() {
        if is_swapped(j) {
            std::mem::swap(&mut x[j], &mut y[j]);
        }
    }
    [x, y]
}

/// Copies of the parents, with every other piece swapped, beginning with the
/// second.
fn swap_between(a: &[f64], b: &[f64], cuts: &[usize]) -> [Genotype; 2] {
    swap_where(a, b, |j| cuts.iter().filter(|&&cut| cut <= j).count() % 2 == 1)
}

/// Up to `n` different cuts, uniformly from the d - 1 places between `d` genes;
/// cut c is before gene c. Sampling without replacement by Floyd's method.
fn cuts(n: usize, d: usize, rng: &mut Stream) -> Vec<usize> {
    let n_places = d - 1;
    let mut cuts = Vec::with_capacity(n);
    for last in n_places - n.min(n_places)..n_places {
        let cut = 1 + rng.below(last + 1);
        cuts.push(if cuts.contains(&cut) { 1 + last } else { cut });
    }
    cuts
}

/// Children (a + b)/2 +- beta (a - b)/2, per gene with beta = (2u)^(1/(n + 1)) for
/// u <= 1/2, else (1/(2 - 2u))^(1/(n + 1)); n is the index.
fn simulated_binary(a: &[f64], b: &[f64], rng: &mut Stream) -> [Genotype; 2] {
    let genes = a.iter().zip(b).map(|(a, b)| {
        let u = rng.uniform();
        let base = if u <= 0.5 { 2.0 * u } else { 1.0 / (2.0 - 2.0 * u) };
        let beta = libm::pow(base, 1.0 / (SBX_INDEX + 1.0));
        let (middle, half) = (0.5 * (a + b), 0.5 * beta * (a - b));
        (middle + half, middle - half)
    });
    let (x, y) = genes.unzip();
    [x, y]
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use determinism::random::Purpose;

    use super::*;
    use crate::tests::ks_statistic;

    const D: usize = 7;
    const A: [f64; D] = [0.0; D];
    const B: [f64; D] = [1.0; D];

    fn rng() -> Stream {
        Stream::new(2, 0, 0, Purpose::Evolution, 0)
    }

    #[test]
    fn blx_alpha_is_uniform_on_the_stretched_interval_of_the_parents() {
        let (a, b, alpha) = (0.7, 0.3, 0.5);
        let (low, high) = (0.1, 0.9);
        let mut rng = rng();
        let mut children = [Vec::new(), Vec::new()];
        for _ in 0..20_000 {
            let [x, y] = Crossover::BlxAlpha { alpha }.cross(&[a], &[b], &mut rng);
            children[0].push(x[0]);
            children[1].push(y[0]);
        }
        let mut dot = 0.0;
        for (x, y) in children[0].iter().zip(&children[1]) {
            assert!((low..=high).contains(x) && (low..=high).contains(y));
            dot += (x - 0.5) * (y - 0.5);
        }
        let correlation = dot / 20_000.0 / (0.8 * 0.8 / 12.0);
        assert!(correlation.abs() < 0.03, "children are drawn independently: {correlation}");
        for values in children {
            assert!(values.iter().any(|x| *x < 0.11) && values.iter().any(|x| *x > 0.89));
            let statistic = ks_statistic(values, |x| (x - low) / (high - low));
            assert!(statistic < 1.95, "{statistic}");
        }
    }

    #[test]
    fn blx_alpha_of_equal_parents_is_the_parent() {
        let [x, y] = Crossover::BlxAlpha { alpha: 0.5 }.cross(&[0.25; 3], &[0.25; 3], &mut rng());
        assert_eq!((x, y), (vec![0.25; 3], vec![0.25; 3]));
    }

    /// Every exchanging operator keeps both parents' genes at their places.
    #[test]
    fn exchanging_operators_lose_no_gene() {
        let mut rng = rng();
        for operator in [Crossover::Uniform, Crossover::OnePoint, Crossover::MultiPoint] {
            for _ in 0..200 {
                let [x, y] = operator.cross(&A, &B, &mut rng);
                assert!(x.iter().zip(&y).all(|(x, y)| x + y == 1.0), "{operator:?} {x:?} {y:?}");
            }
        }
    }

    #[test]
    fn uniform_crossover_swaps_half_of_the_genes() {
        let mut rng = rng();
        let n = 10_000;
        let swapped: f64 =
            (0..n).map(|_| Crossover::Uniform.cross(&A, &B, &mut rng)[0].iter().sum::<f64>()).sum();
        let share = swapped / (n * D) as f64;
        assert!((share - 0.5).abs() < 0.01, "{share}");
    }

    /// Places where the first child changes from one parent to the other.
    fn changes(child: &[f64]) -> Vec<usize> {
        (1..D).filter(|&j| child[j] != child[j - 1]).collect()
    }

    #[test]
    fn one_point_crossover_cuts_every_place_equally_often() {
        let mut rng = rng();
        let mut counts = [0; D];
        for _ in 0..12_000 {
            let [child, _] = Crossover::OnePoint.cross(&A, &B, &mut rng);
            assert_eq!(child[0], A[0]);
            let [cut] = changes(&child)[..] else { panic!("{child:?}") };
            counts[cut] += 1;
        }
        assert!(counts[1..].iter().all(|&count: &i32| (count - 2000).abs() < 170), "{counts:?}");
    }

    #[test]
    fn multi_point_crossover_cuts_every_three_places_equally_often() {
        let mut rng = rng();
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..20_000 {
            let [child, _] = Crossover::MultiPoint.cross(&A, &B, &mut rng);
            assert_eq!(changes(&child).len(), 3);
            *counts.entry(changes(&child)).or_insert(0) += 1;
        }
        assert_eq!(counts.len(), 20, "6 places, 3 cuts");
        assert!(counts.values().all(|&count: &i32| (count - 1000).abs() < 130), "{counts:?}");
    }

    #[test]
    fn short_genotypes_are_cut_where_they_can_be() {
        let mut rng = rng();
        for operator in [Crossover::OnePoint, Crossover::MultiPoint] {
            assert_eq!(operator.cross(&[0.1], &[0.2], &mut rng), [[0.1], [0.2]]);
        }
        let [x, _] = Crossover::MultiPoint.cross(&[0.0; 3], &[1.0; 3], &mut rng);
        assert_eq!(x, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn simulated_binary_spreads_like_single_point_crossover_of_bit_strings() {
        let mut rng = rng();
        let mut betas = Vec::new();
        let mut distinct = BTreeSet::new();
        for _ in 0..20_000 {
            let [x, y] = Crossover::SimulatedBinary.cross(&[0.75, 0.75], &[0.25, 0.25], &mut rng);
            for (x, y) in x.iter().zip(&y) {
                assert!((x + y - 1.0).abs() < 1e-12 * (1.0 + x.abs()), "the mean is kept");
                betas.push((x - y) / 0.5);
            }
            distinct.insert(x[0] == x[1]);
        }
        assert_eq!(distinct, [false].into(), "genes are crossed independently");
        // P(beta) = (n + 1)/2 * beta^n up to 1, (n + 1)/2 / beta^(n + 2) beyond.
        let exponent = SBX_INDEX + 1.0;
        let cdf = |beta: f64| {
            let tail = libm::pow(beta, -exponent) / 2.0;
            if beta <= 1.0 { libm::pow(beta, exponent) / 2.0 } else { 1.0 - tail }
        };
        let statistic = ks_statistic(betas, cdf);
        assert!(statistic < 1.95, "{statistic}");
    }
}

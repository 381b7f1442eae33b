//! Kendall's rank correlation: whether two orders of the same things agree.

use std::f64::consts::SQRT_2;

use schemars::JsonSchema;
use serde::Serialize;

/// Largest number of pairs of values for an exact p-value, if no values are equal.
const EXACT_MAX: usize = 33;

/// How far two orders agree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Kendall {
    /// Tau-b, from -1, opposite orders, to 1, the same order.
    pub tau: f64,
    /// The two-sided p-value of the test that the orders are independent.
    pub p: f64,
}

/// Kendall's tau-b of pairs of values (Kendall 1945). The p-value is exact for up to 33 pairs
/// without equal values, otherwise by the normal approximation. `None` for fewer than two pairs, or
/// if all values of a list are equal: then there is no order.
///
/// # Panics
///
/// If the lists have different lengths.
pub fn kendall(a: &[f64], b: &[f64]) -> Option<Kendall> {
    assert_eq!(a.len(), b.len(), "values come in pairs");
    let n = a.len();
    let (mut concordant, mut discordant) = (0_u32, 0_u32);
    for i in 0..n {
        for j in 0..i {
            let product = order(a[i], a[j]) * order(b[i], b[j]);
            concordant += u32::from(product > 0);
            discordant += u32::from(product < 0);
        }
    }
    let (ties_a, ties_b) = (Ties::new(a), Ties::new(b));
    let pairs = (n * n.saturating_sub(1) / 2) as f64;
    let scale = ((pairs - ties_a.pairs) * (pairs - ties_b.pairs)).sqrt();
    if scale <= 0.0 {
        return None;
    }
    let difference = f64::from(concordant) - f64::from(discordant);
    let is_exact = n <= EXACT_MAX && ties_a.pairs == 0.0 && ties_b.pairs == 0.0;
    let p = if is_exact {
        exact(n, concordant.min(discordant) as usize)
    } else {
        approximate(n as f64, difference, &ties_a, &ties_b)
    };
    Some(Kendall { tau: (difference / scale).clamp(-1.0, 1.0), p: p.min(1.0) })
}

/// -1, 0 or 1.
fn order(x: f64, y: f64) -> i32 {
    i32::from(x > y) - i32::from(x < y)
}

/// Sums over the groups of t equal values.
struct Ties {
    /// Of t (t - 1) / 2, the pairs of equal values.
    pairs: f64,
    /// Of t (t - 1) (t - 2).
    triples: f64,
    /// Of t (t - 1) (2 t + 5).
    weighted: f64,
}

impl Ties {
    fn new(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let mut ties = Self { pairs: 0.0, triples: 0.0, weighted: 0.0 };
        for group in sorted.chunk_by(|x, y| x == y) {
            let t = group.len() as f64;
            ties.pairs += t * (t - 1.0) / 2.0;
            ties.triples += t * (t - 1.0) * (t - 2.0);
            ties.weighted += t * (t - 1.0) * (2.0 * t + 5.0);
        }
        ties
    }
}

/// Twice the probability that a random order of `n` has at most `few` inversions.
fn exact(n: usize, few: usize) -> f64 {
    // The probability of each number of inversions, for orders of 1, 2, ... n: the next thing has
    // any number of inversions with those before it, all equally probable.
    let mut probabilities = vec![0.0; few + 1];
    probabilities[0] = 1.0;
    for length in 2..=n {
        let before = probabilities.clone();
        for (inversions, probability) in probabilities.iter_mut().enumerate() {
            let first = (inversions + 1).saturating_sub(length);
            *probability = before[first..=inversions].iter().sum::<f64>() / length as f64;
        }
    }
    2.0 * probabilities.iter().sum::<f64>()
}

fn approximate(n: f64, difference: f64, a: &Ties, b: &Ties) -> f64 {
    let pairs = n * (n - 1.0);
    // Without three values, there are no triples of equal ones.
    let of_triples = match a.triples * b.triples {
        0.0 => 0.0,
        product => product / (9.0 * pairs * (n - 2.0)),
    };
    let variance = (pairs * (2.0 * n + 5.0) - a.weighted - b.weighted) / 18.0
        + 2.0 * a.pairs * b.pairs / pairs
        + of_triples;
    libm::erfc(difference.abs() / variance.sqrt() / SQRT_2)
}

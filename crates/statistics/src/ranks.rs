//! Compares two samples by ranks.

use std::f64::consts::SQRT_2;

/// Largest size of the smaller sample for an exact p-value, if no values are equal.
const EXACT_MAX: usize = 8;

/// The probability, in \[0, 1\], that a value of `a` is larger than one of `b`; equal values count
/// half. Vargha & Delaney (2000) call it A. NaN if a sample is empty.
pub fn probability_of_improvement(a: &[f64], b: &[f64]) -> f64 {
    statistic(a, b) / (a.len() * b.len()) as f64
}

/// The two-sided p-value of the Mann-Whitney U test that two samples come from the same
/// distribution. Exact if one sample has at most 8 values and no values are equal, otherwise by
/// the normal approximation with corrections for ties and continuity. `None` if a sample is
/// empty.
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Option<f64> {
    if a.is_empty() || b.is_empty() {
        return None;
    }
    let u = statistic(a, b);
    let u = u.max((a.len() * b.len()) as f64 - u);
    let ties = ties(a, b);
    let p = if ties.is_empty() && a.len().min(b.len()) <= EXACT_MAX {
        exact(u as usize, a.len().min(b.len()), a.len().max(b.len()))
    } else {
        approximate(u, a.len() as f64, b.len() as f64, &ties)
    };
    Some(p.min(1.0))
}

/// U: the number of pairs in which the value of `a` is larger, and half the number of pairs of
/// equal values.
fn statistic(a: &[f64], b: &[f64]) -> f64 {
    let wins = |x: &f64| -> f64 {
        b.iter().map(|y| f64::from(u8::from(x > y)) + 0.5 * f64::from(u8::from(x == y))).sum()
    };
    a.iter().map(wins).sum()
}

/// The size of each group of equal values.
fn ties(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = [a, b].concat();
    all.sort_by(f64::total_cmp);
    let groups = all.chunk_by(|x, y| x == y).map(|equal| equal.len() as f64);
    groups.filter(|&n| n > 1.0).collect()
}

/// Twice the probability of a U of at least `u`: twice the share of the ways to choose `n` of `n +
/// m` ranks that give such a U. `ways[k][s]`: the number of ways to choose k ranks whose sum is s
/// above the smallest.
fn exact(u: usize, n: usize, m: usize) -> f64 {
    let mut ways = vec![vec![0.0; n * m + 1]; n + 1];
    ways[0][0] = 1.0;
    for rank in 0..n + m {
        // Downwards in k, so that each rank is chosen at most once.
        for k in (1..=n.min(rank + 1)).rev() {
            // This rank's distance above its smallest possible value, with k - 1 ranks below it.
            let above = rank + 1 - k;
            let (fewer, more) = ways.split_at_mut(k);
            for s in above..=n * m {
                more[0][s] += fewer[k - 1][s - above];
            }
        }
    }
    let all: f64 = ways[n].iter().sum();
    2.0 * ways[n][u..].iter().sum::<f64>() / all
}

fn approximate(u: f64, n: f64, m: f64, ties: &[f64]) -> f64 {
    let all = n + m;
    let tied: f64 = ties.iter().map(|t| t * (t * t - 1.0)).sum();
    let variance = n * m / 12.0 * (all + 1.0 - tied / (all * (all - 1.0)));
    let z = (u - n * m / 2.0 - 0.5) / variance.sqrt();
    // All values are equal.
    if variance <= 0.0 { 1.0 } else { libm::erfc(z / SQRT_2) }
}

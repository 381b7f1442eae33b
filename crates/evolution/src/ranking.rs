//! Ranking by fitness, and the utilities of natural evolution strategies.

use std::cmp::Ordering;

/// Indices of the individuals, best first: larger fitness first, ties by index,
/// NaN and infinities last.
pub fn ranking(fitness: &[f64]) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..fitness.len()).collect();
    // The sort is stable, so equal fitness keeps the order of the indices.
    indices.sort_by(|&a, &b| match (fitness[a].is_finite(), fitness[b].is_finite()) {
        (true, true) => fitness[b].partial_cmp(&fitness[a]).unwrap_or(Ordering::Equal),
        (true, false) => Ordering::Less,
        (false, true) => Ordering::Greater,
        (false, false) => Ordering::Equal,
    });
    indices
}

/// The utilities of ranks k = 1..=n, best first: u_k = max(0, ln(n/2 + 1) - ln k) / sum - 1/n,
/// which sum to 0. Wierstra et al. 2014, section 3.1.
fn utilities(n: usize) -> Vec<f64> {
    let reference = libm::log(n as f64 / 2.0 + 1.0);
    let raw: Vec<f64> = (1..=n).map(|k| (reference - libm::log(k as f64)).max(0.0)).collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|u| u / sum - 1.0 / n as f64).collect()
}

/// The utility of each individual, by its place in the ranking.
pub fn utility_per_individual(ranking: &[usize]) -> Vec<f64> {
    let mut utility_of = vec![0.0; ranking.len()];
    for (&individual, utility) in ranking.iter().zip(utilities(ranking.len())) {
        utility_of[individual] = utility;
    }
    utility_of
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_is_better_ties_go_by_index_and_the_non_finite_come_last() {
        let fitness = [1.0, f64::NAN, 3.0, f64::INFINITY, 3.0, -2.0, f64::NEG_INFINITY];
        assert_eq!(ranking(&fitness), [2, 4, 0, 5, 1, 3, 6]);
    }

    #[test]
    fn zeros_of_both_signs_tie() {
        assert_eq!(ranking(&[-0.0, 0.0, -0.0]), [0, 1, 2]);
        assert_eq!(ranking(&[0.0, -0.0, 0.0]), [0, 1, 2]);
    }

    #[test]
    fn utilities_sum_to_zero_and_reward_the_better_half_only() {
        for n in [1, 2, 3, 10, 100] {
            let utilities = utilities(n);
            assert!(utilities.iter().sum::<f64>().abs() < 1e-12, "{n}");
            assert!(utilities.is_sorted_by(|a, b| a >= b), "{n}");
            assert!(utilities[n.div_ceil(2)..].iter().all(|&u| u == -1.0 / n as f64), "{n}");
        }
    }
}

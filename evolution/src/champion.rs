//! Honest champions.
//!
//! The best of many noisy estimates is optimistic: it was chosen for its luck,
//! too. So from time to time the champion so far, the best individual since, and
//! the mean of the distribution (where an algorithm has one) are judged again, on
//! held-out trials that nothing was selected by, and the champion is who does
//! best there.

use serde::{Deserialize, Serialize};

use super::{Genotype, mean, ranking::ranking};

/// A genotype worth keeping, and what is known of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Champion {
    /// Generation after which it was found.
    pub generation: u64,
    /// Where it comes from.
    pub origin: Origin,
    /// Its genes.
    pub genotype: Genotype,
    /// Fitness in the trials of its generation, for which it was chosen; none
    /// for a mean, which was not judged there.
    pub trial_fitness: Vec<f64>,
    /// Fitness in trials that did not choose it; none before the first
    /// re-evaluation.
    pub held_out: Option<HeldOut>,
}

/// Where a champion comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Origin {
    /// An individual of its generation, by index.
    Individual(u32),
    /// The mean of the distribution after its generation.
    Mean,
}

/// Fitness in held-out trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Mean over the trials.
    pub mean: f64,
    /// Half the width of the 95 % confidence interval of the mean, by the normal
    /// approximation: 1.96 s / sqrt(n).
    pub ci95: f64,
    /// Number of trials n.
    pub n_trials: u32,
    /// Generation whose held-out trials these are.
    pub generation: u64,
}

/// Candidates to be judged on held-out trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Reevaluation {
    /// Generation whose held-out trials they meet.
    pub generation: u64,
    /// The champion so far, if it has been re-evaluated before, comes first.
    pub candidates: Vec<Champion>,
}

impl Champion {
    /// Mean fitness in the trials for which it was chosen: optimistic.
    pub fn fitness(&self) -> Option<f64> {
        (!self.trial_fitness.is_empty()).then(|| mean(&self.trial_fitness))
    }
}

impl Reevaluation {
    /// The candidate with the largest mean in the held-out trials; of equals, the
    /// first. `trial_fitness[i][t]`: fitness of candidate i in trial t. None if
    /// no mean is finite.
    pub fn decide(&self, trial_fitness: &[Vec<f64>]) -> Option<Champion> {
        let means: Vec<f64> = trial_fitness.iter().map(|trials| mean(trials)).collect();
        let best = ranking(&means)[0];
        means[best].is_finite().then(|| Champion {
            held_out: Some(HeldOut {
                mean: means[best],
                ci95: ci95(&trial_fitness[best], means[best]),
                n_trials: trial_fitness[best].len() as u32,
                generation: self.generation,
            }),
            ..self.candidates[best].clone()
        })
    }
}

/// 1.96 s / sqrt(n), s with divisor n - 1; 0 for a single value.
fn ci95(values: &[f64], mean: f64) -> f64 {
    let n = values.len() as f64;
    if values.len() < 2 {
        return 0.0;
    }
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    1.96 * (squares / (n - 1.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(index: u32) -> Champion {
        Champion {
            generation: 9,
            origin: Origin::Individual(index),
            genotype: vec![0.5],
            trial_fitness: vec![9.0],
            held_out: None,
        }
    }

    fn decide(trial_fitness: &[Vec<f64>]) -> Option<Champion> {
        let candidates = (0..trial_fitness.len() as u32).map(candidate).collect();
        Reevaluation { generation: 9, candidates }.decide(trial_fitness)
    }

    #[test]
    fn the_best_on_held_out_trials_wins_whatever_it_was_thought_to_be() {
        let winner = decide(&[vec![1.0, 2.0], vec![2.0, 4.0], vec![f64::NAN, 9.0]]).unwrap();
        assert_eq!(winner.origin, Origin::Individual(1));
        let held_out = winner.held_out.unwrap();
        assert_eq!((held_out.mean, held_out.n_trials, held_out.generation), (3.0, 2, 9));
        // s = sqrt(2), n = 2
        assert!((held_out.ci95 - 1.96).abs() < 1e-15);
        assert_eq!(winner.fitness(), Some(9.0));
    }

    #[test]
    fn of_equals_the_first_stays() {
        assert_eq!(decide(&[vec![1.0], vec![1.0]]).unwrap().origin, Origin::Individual(0));
    }

    #[test]
    fn nobody_wins_without_a_finite_mean() {
        assert_eq!(decide(&[vec![f64::NAN], vec![f64::INFINITY]]), None);
    }
}

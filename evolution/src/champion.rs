//! Champions, and their re-evaluation.
//!
//! The best of many noisy estimates is optimistic: the noise of its trials took
//! part in choosing it. So at intervals three candidates are evaluated on held-out
//! trials, which no selection has used: the champion so far, the best individual
//! since the last re-evaluation, and the mean of the distribution (where an
//! algorithm has one). The one with the largest mean fitness there becomes the
//! champion.

use serde::{Deserialize, Serialize};

use super::{Genotype, mean, ranking::ranking};

/// A genotype worth keeping, and what is known of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Champion {
    /// Generation after which it was found.
    pub generation: u64,
    /// Where it comes from; checkpoints call it `origin`.
    #[serde(rename = "origin")]
    pub source: ChampionSource,
    /// Its genes.
    pub genotype: Genotype,
    /// Fitness in the trials of its generation, for which it was chosen; none
    /// for a mean, which was not evaluated there.
    pub trial_fitness: Vec<f64>,
    /// Fitness in trials that did not choose it; none before the first
    /// re-evaluation.
    pub held_out: Option<HeldOut>,
}

/// Where a champion comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ChampionSource {
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

/// Candidates to be evaluated on held-out trials.
#[derive(Debug, Clone, PartialEq)]
pub struct Reevaluation {
    /// Generation whose held-out trials evaluate them.
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
            source: ChampionSource::Individual(index),
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
    fn the_best_on_held_out_trials_wins_whatever_its_fitness_before() {
        let winner = decide(&[vec![1.0, 2.0], vec![2.0, 4.0], vec![f64::NAN, 9.0]]).unwrap();
        assert_eq!(winner.source, ChampionSource::Individual(1));
        let held_out = winner.held_out.unwrap();
        assert_eq!((held_out.mean, held_out.n_trials, held_out.generation), (3.0, 2, 9));
        // s = sqrt(2), n = 2
        assert!((held_out.ci95 - 1.96).abs() < 1e-15);
        assert_eq!(winner.fitness(), Some(9.0));
    }

    #[test]
    fn of_equals_the_first_stays() {
        assert_eq!(decide(&[vec![1.0], vec![1.0]]).unwrap().source, ChampionSource::Individual(0));
    }

    #[test]
    fn without_a_finite_mean_there_is_no_new_champion() {
        assert_eq!(decide(&[vec![f64::NAN], vec![f64::INFINITY]]), None);
    }
}

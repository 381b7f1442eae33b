//! Measures how evolution moves: the change of the distribution in a generation, and the
//! agreement of its trials.

use super::{CheckpointError, Digest, Evolution, Told, statistics::between};

/// The change of evolution in one generation.
#[derive(Debug, Clone, PartialEq)]
pub struct Dynamics {
    /// Its link of the digest chain.
    pub digest: Digest,
    /// Euclidean distance between the means of the distribution before and after the generation;
    /// `None` without a distribution.
    pub mean_step: Option<f64>,
    /// Minimum, first quartile, median, third quartile and maximum of the genes' standard
    /// deviations after the generation; `None` without a distribution.
    pub deviations: Option<[f64; 5]>,
    /// Spearman's rank correlation between the individuals' fitness in two trials, as the mean
    /// over all pairs of trials, in \[-1, 1\]: 1 if all trials rank the individuals alike, 0 if
    /// selection by a single trial is luck. `None` with fewer than two trials, or if all
    /// individuals have equal fitness in a trial.
    pub rank_correlation: Option<f64>,
}

impl Evolution {
    /// Repeats a generation, and measures how it changes evolution.
    ///
    /// # Errors
    ///
    /// If `told` does not fit this state, or has no finite fitness.
    pub fn dynamics(&mut self, told: &Told) -> Result<Dynamics, CheckpointError> {
        let before = self.mean();
        let digest = self.repeat(told)?.summary.digest;
        let mean_step = before.zip(self.mean()).map(|(before, after)| {
            let squares = before.iter().zip(&after).map(|(a, b)| (a - b) * (a - b));
            squares.sum::<f64>().sqrt()
        });
        let of_each = self.populations.iter().map(|population| population.deviations());
        let deviations: Option<Vec<Vec<f64>>> = of_each.collect();
        Ok(Dynamics {
            digest,
            mean_step,
            deviations: deviations.map(|deviations| quantiles(deviations.concat())),
            rank_correlation: rank_correlation(&told.trial_fitness),
        })
    }
}

/// The quantiles at 0, 1/4, 1/2, 3/4 and 1, by linear interpolation.
fn quantiles(mut values: Vec<f64>) -> [f64; 5] {
    values.sort_by(f64::total_cmp);
    let last = values.len() - 1;
    [0, 1, 2, 3, 4].map(|quarter| {
        let position = last * quarter;
        let (below, rest) = (position / 4, (position % 4) as f64 / 4.0);
        between(values[below], values[last.min(below + 1)], rest)
    })
}

/// See [`Dynamics::rank_correlation`]. `trial_fitness[i][t]`: fitness of individual i in trial t.
/// Individuals without finite fitness in every trial are ignored.
fn rank_correlation(trial_fitness: &[Vec<f64>]) -> Option<f64> {
    let finite: Vec<&Vec<f64>> = trial_fitness
        .iter()
        .filter(|trials| trials.iter().all(|fitness| fitness.is_finite()))
        .collect();
    let n_trials = finite.first()?.len();
    let deviations: Vec<Vec<f64>> = (0..n_trials)
        .filter_map(|trial| deviations_of_ranks(finite.iter().map(|of| of[trial]).collect()))
        .collect();
    if deviations.len() < n_trials || n_trials < 2 {
        return None;
    }
    let mut sum = 0.0;
    for (t, a) in deviations.iter().enumerate() {
        for b in &deviations[..t] {
            sum += a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        }
    }
    Some(sum / (n_trials * (n_trials - 1) / 2) as f64)
}

/// Ranks minus their mean, scaled to length 1; equal values share a rank. `None` if all are
/// equal.
fn deviations_of_ranks(values: Vec<f64>) -> Option<Vec<f64>> {
    let rank = |value: f64| {
        let below = values.iter().filter(|&&other| other < value).count() as f64;
        let equal = values.iter().filter(|&&other| other == value).count() as f64;
        below + (equal - 1.0) / 2.0
    };
    let middle = (values.len() as f64 - 1.0) / 2.0;
    let deviations: Vec<f64> = values.iter().map(|&value| rank(value) - middle).collect();
    let length = deviations.iter().map(|deviation| deviation * deviation).sum::<f64>().sqrt();
    (length > 0.0).then(|| deviations.into_iter().map(|deviation| deviation / length).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Setup, tests::by_fitness};

    #[test]
    fn trials_that_rank_alike_correlate_and_opposite_ones_do_not() {
        let correlation = |trials: [[f64; 4]; 2]| {
            let told: Vec<Vec<f64>> = (0..4).map(|i| vec![trials[0][i], trials[1][i]]).collect();
            rank_correlation(&told)
        };
        let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(near(correlation([[1.0, 2.0, 3.0, 4.0], [1.0, 8.0, 9.0, 70.0]]), 1.0));
        assert!(near(correlation([[1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0]]), -1.0));
        // Ranks 0, 1.5, 1.5, 3 and 0, 2, 1, 3: 4.5 / sqrt(4.5 * 5).
        assert!(near(
            correlation([[1.0, 2.0, 2.0, 4.0], [1.0, 3.0, 2.0, 4.0]]),
            0.948_683_298_050_513_8
        ));
        assert_eq!(correlation([[1.0, 1.0, 1.0, 1.0], [1.0, 2.0, 3.0, 4.0]]), None);
        assert_eq!(rank_correlation(&[vec![1.0], vec![2.0]]), None);
        assert_eq!(rank_correlation(&[vec![f64::NAN, 1.0]]), None);
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        assert_eq!(quantiles(vec![5.0, 1.0, 2.0, 4.0, 3.0]), [1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(quantiles(vec![7.0]), [7.0; 5]);
        assert_eq!(quantiles(vec![0.0, 1.0]), [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn every_distribution_reports_its_step_and_its_width() {
        for algorithm in by_fitness() {
            let mut evolution = Setup::new(algorithm.name, 6).start().unwrap();
            let mut same = evolution.clone();
            for _ in 0..3 {
                let genotypes = evolution.ask().genotypes;
                let told = Told::from_fitness(
                    genotypes.iter().map(|genes| vec![genes[0], genes[1]]).collect(),
                );
                let before = evolution.mean();
                let found = evolution.dynamics(&told).unwrap();
                same.repeat(&told).unwrap();
                assert_eq!((&same, found.digest), (&evolution, evolution.digest()));
                let moved = before.zip(evolution.mean());
                assert_eq!(found.mean_step.is_some(), moved.is_some(), "{}", algorithm.name);
                assert_eq!(found.mean_step.is_some(), found.deviations.is_some());
                assert!(found.mean_step.is_none_or(|step| step > 0.0 && step < 2.5));
                let deviations = found.deviations.unwrap_or([1.0; 5]);
                assert!(deviations.is_sorted() && deviations[0] > 0.0, "{}", algorithm.name);
            }
        }
    }

    #[test]
    fn samples_have_the_reported_deviations() {
        for name in ["SNES", "xNES", "CMA-ES", "sep-CMA-ES", "openaiES", "PGPE"] {
            let setup = Setup { population_size: 4000, ..Setup::new(name, 2) };
            let evolution = setup.start().unwrap();
            let deviations = evolution.populations[0].deviations().unwrap();
            let genotypes = evolution.ask().genotypes;
            for (j, expected) in deviations.iter().enumerate() {
                let genes: Vec<f64> = genotypes.iter().map(|genes| genes[j]).collect();
                let found = crate::Statistics::from_fitness(&genes).standard_deviation.get();
                assert!((found / expected - 1.0).abs() < 0.06, "{name}: {found} {expected}");
            }
        }
    }
}

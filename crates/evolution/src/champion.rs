//! Champions, and the estimates of their fitness.
//!
//! The best of many noisy estimates is optimistic, because the noise of its trials took part in
//! the choice. So a [`Reevaluation`](super::Reevaluation) compares candidates on trials that
//! evolution has not met, and a [`Judgement`](super::Judgement) measures the winner's fitness on
//! trials that compared no candidates.

use serde::{Deserialize, Deserializer, Serialize};

use super::{Genotype, Real, mean};

/// A genotype worth keeping, with the estimates of its fitness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Champion {
    /// Generation after which it became a candidate.
    pub generation: u64,
    /// Its origin; checkpoints call it `origin`.
    #[serde(rename = "origin")]
    pub source: ChampionSource,
    /// Its genes.
    pub genotype: Genotype,
    /// Fitness in the trials of its generation, which made it a candidate; empty for a mean, which
    /// is not evaluated in its generation.
    pub trial_fitness: Vec<f64>,
    /// Fitness in all held-out trials that compared the champion with other candidates; `None`
    /// before the first re-evaluation.
    pub held_out: Option<HeldOut>,
    /// Fitness in trials that selected nothing, at the end of a run. Evolution does not need it,
    /// so checkpoints omit it.
    #[serde(skip)]
    pub judged: Option<Judged>,
}

/// The origin of a champion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ChampionSource {
    /// An individual of its generation, by index.
    Individual(u32),
    /// The mean of the distribution after its generation.
    Mean,
}

/// Fitness in the held-out trials of one or more re-evaluations. These trials compared
/// candidates, so the winner's mean is optimistic.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HeldOut {
    /// Mean over the trials.
    pub mean: Real,
    /// 1.96 s / sqrt(n), s with divisor n - 1; 0 for a single trial, infinite if squares overflow.
    /// This interval decides whether candidates are close. It is no confidence interval of the
    /// winner's honest fitness.
    #[serde(deserialize_with = "interval_of_any_version")]
    pub ci95: Real,
    /// Number of trials n.
    pub n_trials: u64,
    /// Generation of the latest of these trials.
    pub generation: u64,
}

/// Reads states of older versions, which may have NaN where sums overflowed. NaN stands for an
/// unknown error of the mean, and becomes infinity, as in the database.
fn interval_of_any_version<'de, D: Deserializer<'de>>(state: D) -> Result<Real, D::Error> {
    let unknown = Real::new(f64::INFINITY).expect("infinity is a number");
    Ok(Real::new(f64::deserialize(state)?).unwrap_or(unknown))
}

/// Fitness in trials that selected nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Mean over the trials.
    pub mean: Real,
    /// Lower end of the 95 % confidence interval of the mean.
    pub low: Real,
    /// Upper end of the interval.
    pub high: Real,
    /// Number of trials.
    pub n_trials: u32,
    /// Generation after which it was judged, the last one of the run.
    pub generation: u64,
}

impl Champion {
    /// Mean fitness in the trials of its generation. This estimate is optimistic.
    pub fn fitness(&self) -> Option<f64> {
        (!self.trial_fitness.is_empty()).then(|| mean(&self.trial_fitness))
    }
}

/// The 0.975 quantile of the normal distribution, rounded as in stored values.
const Z: f64 = 1.96;

impl HeldOut {
    /// The fitness in trials of this generation; `None` if the mean is not finite.
    pub fn from_values(values: &[f64], generation: u64) -> Option<Self> {
        let mean = mean(values);
        let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum();
        Self::from_squares(mean, squares, values.len() as u64, generation)
    }

    /// The fitness in these and later trials together (Chan, Golub & LeVeque 1983); `None` if the
    /// mean is not finite.
    pub fn with(self, later: Self) -> Option<Self> {
        let (n, n_later) = (self.n_trials as f64, later.n_trials as f64);
        let (share, difference) = (n_later / (n + n_later), later.mean.get() - self.mean.get());
        let squares = self.squares() + later.squares() + difference * difference * n * share;
        let n_trials = self.n_trials + later.n_trials;
        let mean = self.mean.get() + difference * share;
        Self::from_squares(mean, squares, n_trials, later.generation)
    }

    /// Whether chance alone may explain, at 95 %, that this mean is below that of `best`.
    pub fn is_close_to(&self, best: &Self) -> bool {
        let difference = best.mean.get() - self.mean.get();
        let [own, other] = [self.ci95.get(), best.ci95.get()];
        difference * difference < own * own + other * other
    }

    fn from_squares(mean: f64, squares: f64, n_trials: u64, generation: u64) -> Option<Self> {
        let n = n_trials as f64;
        let ci95 = if n_trials < 2 { 0.0 } else { Z * (squares / (n - 1.0) / n).sqrt() };
        let mean = Real::finite(mean)?;
        Some(Self { mean, ci95: Real::new(ci95)?, n_trials, generation })
    }

    /// Sum of squared differences from the mean.
    fn squares(&self) -> f64 {
        let (n, error) = (self.n_trials as f64, self.ci95.get() / Z);
        error * error * n * (n - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_of_two_rounds_count_like_those_of_one() {
        let (first, later) = ([1.0, 2.0, 4.0], [8.0, 3.0]);
        let held_out =
            |values: &[f64], generation| HeldOut::from_values(values, generation).unwrap();
        let together = held_out(&first, 3).with(held_out(&later, 9)).unwrap();
        let at_once = held_out(&[first.to_vec(), later.to_vec()].concat(), 9);
        assert_eq!((together.n_trials, together.generation), (5, 9));
        assert!((together.mean.get() - at_once.mean.get()).abs() < 1e-15, "{together:?}");
        assert!((together.ci95.get() - at_once.ci95.get()).abs() < 1e-14, "{together:?}");
        // s^2 = 29.2 / 4, n = 5
        assert!((at_once.ci95.get() - 1.96 * 1.46f64.sqrt()).abs() < 1e-14, "{at_once:?}");
    }

    #[test]
    fn candidates_are_close_if_chance_may_have_ordered_them() {
        let held_out = |mean: f64, ci95: f64| {
            let [mean, ci95] = [mean, ci95].map(|value| Real::new(value).unwrap());
            HeldOut { mean, ci95, n_trials: 50, generation: 0 }
        };
        assert!(held_out(1.0, 0.3).is_close_to(&held_out(1.49, 0.4)));
        assert!(!held_out(1.0, 0.3).is_close_to(&held_out(1.51, 0.4)));
        assert!(
            !held_out(1.0, 0.0).is_close_to(&held_out(1.0, 0.0)),
            "more trials would show nothing new"
        );
    }
}

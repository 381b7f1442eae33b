//! The trials of an individual, one of which a replay shows: their fitness, and the median trial.

use serde::Serialize;
use sim_core::{EvaluateError, Simulation, TrialSet};

/// The judgement of a champion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// The generation that it follows.
    pub generation: u64,
    /// Number of its trials.
    pub trials: u32,
    /// Mean fitness.
    pub mean: f64,
    /// Ends of the 95 % confidence interval of the mean.
    pub interval: (f64, f64),
}

/// The trials that define the fitness of an individual.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trials {
    /// Whether these are the trials of the judgement, which selected nothing, instead of those of
    /// its generation.
    is_judgement: bool,
    generation: u64,
    /// The fitness of each trial, in their order.
    fitness: Vec<f64>,
    mean: f64,
    /// Ends of the 95 % confidence interval of the mean, of a judgement.
    interval: Option<(f64, f64)>,
    median: u32,
    worst: u32,
    best: u32,
}

impl Trials {
    /// The trials of a champion's judgement, simulated again; none if `keep_going` returns
    /// false on the way.
    pub fn of_judgement(
        simulation: &Simulation,
        genotype: &[f64],
        judged: Judged,
        keep_going: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, EvaluateError> {
        let Judged { generation, trials, mean, interval } = judged;
        let set = TrialSet::Judgement(generation);
        let fitness = simulation.evaluate_while(genotype, set, 0..trials, keep_going)?;
        Ok(fitness.map(|fitness| {
            let interval = Some(interval);
            Self { is_judgement: true, mean, interval, ..Self::of_generation(generation, fitness) }
        }))
    }

    /// The trials of an individual's generation.
    pub fn of_generation(generation: u64, fitness: Vec<f64>) -> Self {
        let mut order: Vec<u32> = (0..fitness.len() as u32).collect();
        order.sort_by(|&a, &b| fitness[a as usize].total_cmp(&fitness[b as usize]));
        let nth = |n: usize| order.get(n).copied().unwrap_or_default();
        let last = fitness.len().saturating_sub(1);
        Self {
            is_judgement: false,
            generation,
            mean: fitness.iter().sum::<f64>() / fitness.len().max(1) as f64,
            interval: None,
            // The lower one of two middle values.
            median: nth(last / 2),
            worst: nth(0),
            best: nth(last),
            fitness,
        }
    }

    /// The median trial.
    pub fn median(&self) -> u32 {
        self.median
    }

    /// The fitness in a trial; 0 if there is no such trial.
    pub fn fitness(&self, trial: u32) -> f64 {
        self.fitness.get(trial as usize).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_middle_trials_the_median_is_the_lower_one() {
        let worst_median_best = |fitness: &[f64]| {
            let trials = Trials::of_generation(3, fitness.to_vec());
            (trials.worst, trials.median, trials.best)
        };
        assert_eq!(worst_median_best(&[5.0, 1.0, 3.0]), (1, 2, 0));
        assert_eq!(worst_median_best(&[5.0, 1.0, 3.0, 2.0]), (1, 3, 0));
        assert_eq!(worst_median_best(&[7.0]), (0, 0, 0));
        assert_eq!(worst_median_best(&[]), (0, 0, 0));
    }
}

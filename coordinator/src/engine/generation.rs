//! A generation that is being judged.

use std::{collections::VecDeque, ops::Range, sync::Arc, time::Instant};

use crate::evolution::Genotype;

use super::{FleetTime, JudgedGeneration};

/// A part of a generation: one individual on a range of trials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Task {
    /// Index of the individual.
    pub individual: u32,
    /// Trials to run.
    pub trials: Range<u32>,
    /// Attempts that failed or took their worker down.
    pub n_failed_attempts: u32,
}

/// A generation that is being judged.
#[derive(Debug)]
pub struct GenerationInProgress {
    /// Index of the generation, or address of held-out trials.
    pub number: u64,
    /// One per individual.
    pub genotypes: Vec<Arc<Genotype>>,
    /// What no worker has been given, in the order in which it will be.
    pub queue: VecDeque<Task>,
    /// Per individual and trial; NaN until judged, but only `n_trials_left` says
    /// whether it is.
    trial_fitness: Vec<Vec<f64>>,
    n_trials_left: usize,
    started: Instant,
    fleet_time_at_start: FleetTime,
}

impl GenerationInProgress {
    /// A generation of which nothing is judged.
    pub fn new(
        number: u64,
        genotypes: Vec<Genotype>,
        n_trials: u32,
        now: Instant,
        fleet_time: FleetTime,
    ) -> Self {
        let queue = (0..genotypes.len())
            .map(|i| Task { individual: i as u32, trials: 0..n_trials, n_failed_attempts: 0 })
            .collect();
        Self {
            number,
            queue,
            trial_fitness: vec![vec![f64::NAN; n_trials as usize]; genotypes.len()],
            n_trials_left: genotypes.len() * n_trials as usize,
            genotypes: genotypes.into_iter().map(Arc::new).collect(),
            started: now,
            fleet_time_at_start: fleet_time,
        }
    }

    /// Records the fitness of a task. Each task is accepted once: it is either
    /// queued, or assigned to one worker, or accepted.
    pub fn accept(&mut self, task: &Task, fitness: Vec<f64>) {
        let trials = task.trials.start as usize..task.trials.end as usize;
        self.n_trials_left -= trials.len();
        self.trial_fitness[task.individual as usize][trials].copy_from_slice(&fitness);
    }

    /// Trials whose fitness is not known.
    #[cfg(test)]
    pub fn n_trials_left(&self) -> usize {
        self.n_trials_left
    }

    /// What it is called in messages.
    pub fn name(&self) -> String {
        match self.number.checked_sub(sim_core::held_out(0)) {
            Some(generation) => format!("the re-evaluation after generation {generation}"),
            None => format!("generation {}", self.number),
        }
    }

    /// Whether all fitness is known.
    pub fn is_judged(&self) -> bool {
        self.n_trials_left == 0
    }

    /// The outcome.
    pub fn into_judged(
        self,
        now: Instant,
        n_workers: usize,
        fleet_time: &FleetTime,
    ) -> JudgedGeneration {
        JudgedGeneration {
            generation: self.number,
            trial_fitness: self.trial_fitness,
            duration: now.saturating_duration_since(self.started),
            n_workers,
            idle_share: fleet_time.idle_share_since(&self.fleet_time_at_start),
        }
    }
}

//! The results of a batch: the numbers of its trials, and the workers that computed them.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
    sync::Arc,
};

use model::ids::WorkerId;

use super::{item::Item, trust::questions::Party};

/// The worker id of a trial without a result.
const NOBODY: WorkerId = WorkerId(0);
/// The worker id of a trial that the referee has computed.
pub const REFEREE: WorkerId = WorkerId(u64::MAX);

/// Two workers' results for the same trial differ.
#[derive(Debug, Clone)]
pub struct Disagreement {
    /// The worker whose result came first; `None` for the referee, whose results are right.
    pub first: Option<Party>,
    /// The trial.
    pub trial: u32,
    /// The numbers of the trial, of the first result and of the second.
    pub values: [Vec<f64>; 2],
}

/// The results of a batch so far.
#[derive(Debug)]
pub struct KnownResults {
    /// Number of trials per individual.
    n_trials: u32,
    values_per_trial: usize,
    /// For each individual, the numbers of all trials; meaningless for trials without a result.
    values: Vec<Vec<f64>>,
    /// The worker that computed each trial, or [`NOBODY`]; flattened, shape
    /// `[individual][trial]`.
    evaluated_by: Vec<WorkerId>,
    /// The names of all workers in `evaluated_by`.
    names: BTreeMap<WorkerId, Arc<str>>,
    n_episodes_left: usize,
}

impl KnownResults {
    /// A batch without results.
    pub fn new(n_individuals: usize, n_trials: u32, values_per_trial: usize) -> Self {
        let n_episodes = n_individuals * n_trials as usize;
        let n_values = n_trials as usize * values_per_trial;
        Self {
            n_trials,
            values_per_trial,
            values: vec![vec![f64::NAN; n_values]; n_individuals],
            evaluated_by: vec![NOBODY; n_episodes],
            names: BTreeMap::new(),
            n_episodes_left: n_episodes,
        }
    }

    /// Number of trials of all individuals.
    pub fn n_episodes(&self) -> usize {
        self.evaluated_by.len()
    }

    /// Number of trials without a result.
    pub fn n_episodes_left(&self) -> usize {
        self.n_episodes_left
    }

    /// Whether a trial has a result.
    pub fn has(&self, individual: u32, trial: u32) -> bool {
        self.by(individual, trial) != NOBODY
    }

    /// The name of the worker that computed a trial; none without a result, and if the referee
    /// computed it.
    pub fn name(&self, individual: u32, trial: u32) -> Option<&Arc<str>> {
        self.names.get(&self.by(individual, trial))
    }

    /// The names of the workers that contributed.
    pub fn names(&self) -> impl Iterator<Item = &Arc<str>> {
        self.names.values()
    }

    /// Splits an item into parts, each of which one worker computed.
    pub fn by_worker(&self, item: &Item) -> Vec<Item> {
        let individual = item.individual;
        let mut parts: Vec<Item> = Vec::new();
        for trial in item.trials.clone() {
            let by = self.by(individual, trial);
            match parts.last_mut() {
                Some(part) if self.by(individual, part.trials.start) == by => part.trials.end += 1,
                _ => parts.push(Item { individual, trials: trial..trial + 1 }),
            }
        }
        parts
    }

    /// Compares a worker's numbers with the known results.
    pub fn compare(&self, item: &Item, numbers: &[f64]) -> Result<(), Disagreement> {
        for (trial, values) in item.trials.clone().zip(numbers.chunks_exact(self.values_per_trial))
        {
            let id = self.by(item.individual, trial);
            if id == NOBODY {
                continue;
            }
            let known = &self.values[item.individual as usize][self.places(trial)];
            if !same_bits(known, values) {
                let name = self.names.get(&id).map(Arc::clone);
                let first = name.map(|name| Party { id, name });
                let values = [known.to_vec(), values.to_vec()];
                return Err(Disagreement { first, trial, values });
            }
        }
        Ok(())
    }

    /// Records the numbers of an item's trials that have none yet; returns the number of these
    /// trials.
    pub fn accept(&mut self, worker: WorkerId, name: &str, item: &Item, numbers: &[f64]) -> usize {
        let mut n_new = 0;
        for (trial, values) in item.trials.clone().zip(numbers.chunks_exact(self.values_per_trial))
        {
            let (index, places) = (self.index(item.individual, trial), self.places(trial));
            if self.evaluated_by[index] == NOBODY {
                self.evaluated_by[index] = worker;
                self.values[item.individual as usize][places].copy_from_slice(values);
                n_new += 1;
            }
        }
        if n_new > 0 && worker != REFEREE && !self.names.contains_key(&worker) {
            self.names.insert(worker, name.into());
        }
        self.n_episodes_left -= n_new;
        n_new
    }

    /// Forgets the results of workers of this name; returns their items, each with a contiguous
    /// range of trials.
    pub fn discard(&mut self, name: &str) -> Vec<Item> {
        let faulty = self.names.extract_if(.., |_, worker_name| **worker_name == *name);
        let faulty: BTreeSet<WorkerId> = faulty.map(|(id, _)| id).collect();
        if faulty.is_empty() {
            return Vec::new();
        }
        let mut discarded = Vec::new();
        for individual in 0..self.values.len() as u32 {
            let whole = Item { individual, trials: 0..self.n_trials };
            let is_faulty = |trial| faulty.contains(&self.by(individual, trial));
            discarded.extend(whole.parts(is_faulty));
        }
        for item in &discarded {
            for trial in item.trials.clone() {
                let index = self.index(item.individual, trial);
                self.evaluated_by[index] = NOBODY;
            }
            self.n_episodes_left += item.trials.len();
        }
        discarded
    }

    /// For each individual, the numbers of all trials; meaningless for trials without a result.
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// For each individual, the numbers of all trials.
    pub fn into_values(self) -> Vec<Vec<f64>> {
        self.values
    }

    /// Panics if the state contradicts itself.
    pub fn sanity_check(&self) {
        let n_known = self.evaluated_by.iter().filter(|&&worker| worker != NOBODY).count();
        assert_eq!(n_known + self.n_episodes_left, self.evaluated_by.len());
    }

    fn by(&self, individual: u32, trial: u32) -> WorkerId {
        self.evaluated_by[self.index(individual, trial)]
    }

    fn index(&self, individual: u32, trial: u32) -> usize {
        individual as usize * self.n_trials as usize + trial as usize
    }

    /// The indices of a trial's numbers among those of its individual.
    fn places(&self, trial: u32) -> Range<usize> {
        let first = trial as usize * self.values_per_trial;
        first..first + self.values_per_trial
    }
}

/// Whether numbers agree in every bit.
pub fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

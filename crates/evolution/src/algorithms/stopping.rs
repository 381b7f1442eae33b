//! Whether a run of CMA-ES has anything more to find, by the criteria and constants of the package
//! `cma` (Hansen). An iteration is a generation of CMA-ES, whatever its number of individuals.

use serde::{Deserialize, Serialize};

use super::{cma_es::CmaEs, linalg::Eigen};

/// Whether a run goes on, and why not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// It goes on.
    GoOn,
    /// `tolfun`: all fitness of the iteration and the best of the latest ones differ too little.
    Flat,
    /// `tolfunhist`: the best of the latest iterations differ too little.
    FlatBest,
    /// `tolstagnation`: neither best nor median fitness has become better for long.
    Stagnation,
    /// `tolx`: individuals are alike.
    Narrow,
    /// `tolconditioncov`: the longest axis is too much longer than the shortest one.
    Condition,
    /// `maxiter`: it has taken too many iterations.
    Iterations,
    /// It was a short run, and its generations are used up.
    Budget,
}

const RANGE_MIN: f64 = 1e-11;
pub const RANGE_OF_BEST_MIN: f64 = 1e-12;
/// The package's 1e-11 is below the smallest deviation of the distribution.
pub const DEVIATION_MIN: f64 = 1e-9;
pub const CONDITION_MAX: f64 = 1e14;

/// Fewest iterations that show that fitness is flat.
const FLAT_ITERATIONS_MIN: usize = 10;

/// Stagnation is judged by every fifth iteration, and by at most this many of them.
const SPARSITY: u64 = 5;
const SPARSE_MAX: usize = 20_000;

/// Eigenvalues are computed in every tenth iteration, because that takes as long as drawing.
const CONDITION_EVERY: u64 = 10;

/// The fitness of the iterations of a run so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    n_iterations: u64,
    /// Best fitness of the latest iterations, the newest last.
    latest: Vec<f64>,
    /// Best and median fitness of every fifth iteration, the newest last.
    best: Vec<f64>,
    median: Vec<f64>,
    best_ever: f64,
    /// Number of individuals after the best one.
    n_since_best: u64,
    /// Difference between the best and the worst fitness of the latest iteration.
    range: f64,
}

impl Progress {
    /// Before the first iteration.
    pub fn new() -> Self {
        Self {
            n_iterations: 0,
            latest: Vec::new(),
            best: Vec::new(),
            median: Vec::new(),
            best_ever: f64::MIN,
            n_since_best: 0,
            range: 0.0,
        }
    }

    /// Adds an iteration over `d` genes. All fitness is finite.
    pub fn add(&mut self, d: usize, fitness: &[f64], ranking: &[usize]) {
        let n = fitness.len();
        let best = fitness[ranking[0]];
        self.n_iterations += 1;
        self.n_since_best += n as u64;
        if best > self.best_ever {
            self.best_ever = best;
            self.n_since_best = (n - 1 - ranking[0]) as u64;
        }
        // Halved first, because the largest numbers overflow in their difference.
        self.range = (2.0 * (best / 2.0 - fitness[ranking[n - 1]] / 2.0)).min(f64::MAX);
        push(&mut self.latest, best, 10 + 30 * d / n);
        if self.n_iterations.is_multiple_of(SPARSITY) {
            let [low, high] = [n / 2, (n - 1) / 2].map(|place| fitness[ranking[place]] / 2.0);
            push(&mut self.best, best, SPARSE_MAX);
            push(&mut self.median, low + high, SPARSE_MAX);
        }
    }

    /// The verdict on a run by its fitness, in iterations of `n` individuals with `d` genes.
    pub fn verdict(&self, d: usize, n: usize) -> Verdict {
        let range_of_best = range(&self.latest);
        let is_over = self.latest.len() >= FLAT_ITERATIONS_MIN;
        let (d, n) = (d as f64, n as f64);
        if is_over && self.range < RANGE_MIN && range_of_best < RANGE_MIN {
            Verdict::Flat
        } else if is_over && range_of_best < RANGE_OF_BEST_MIN {
            Verdict::FlatBest
        } else if self.stagnates(d, n) {
            Verdict::Stagnation
        } else if self.n_iterations as f64
            >= 100.0 + (150.0 * (d + 3.0) * (d + 3.0) / n.sqrt()).floor()
        {
            Verdict::Iterations
        } else {
            Verdict::GoOn
        }
    }

    fn stagnates(&self, d: f64, n: f64) -> bool {
        let tolerated = (100.0 + 100.0 * d * d.sqrt() / n).floor();
        let len = self.best.len();
        let window = (tolerated / 10.0).max(len as f64 / 10.0) as usize;
        let is_not_better = |values: &[f64]| {
            let (before, newest) = values.split_at(len - window);
            median(newest) <= median(&before[before.len() - window..])
        };
        self.n_iterations as f64 > d * (5.0 + 100.0 / n)
            && self.n_since_best as f64 / n > tolerated / 2.0
            && len > 100
            && 2 * window < len
            && is_not_better(&self.median)
            && is_not_better(&self.best)
    }

    /// The verdict on a run by its distribution.
    pub fn verdict_on(&self, run: &CmaEs) -> Verdict {
        if run.is_narrower_than(DEVIATION_MIN) {
            return Verdict::Narrow;
        }
        let is_due = self.n_iterations.is_multiple_of(CONDITION_EVERY);
        if is_due && condition(&run.eigen()) > CONDITION_MAX {
            return Verdict::Condition;
        }
        Verdict::GoOn
    }
}

impl Verdict {
    /// The verdict in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::GoOn => "it goes on",
            Self::Flat => "fitness no longer differs",
            Self::FlatBest => "the best fitness no longer changes",
            Self::Stagnation => "fitness has not become better for long",
            Self::Narrow => "all individuals are alike",
            Self::Condition => "the distribution has become too flat",
            Self::Iterations => "it took too many iterations",
            Self::Budget => "it was a short run",
        }
    }
}

/// Appends a value, and keeps at most the `len_max` newest ones.
fn push(values: &mut Vec<f64>, value: f64, len_max: usize) {
    values.push(value);
    let n_old = values.len().saturating_sub(len_max);
    values.drain(..n_old);
}

fn range(values: &[f64]) -> f64 {
    let max = values.iter().copied().fold(f64::MIN, f64::max);
    let min = values.iter().copied().fold(f64::MAX, f64::min);
    max - min
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    sorted[n / 2] / 2.0 + sorted[(n - 1) / 2] / 2.0
}

/// The largest eigenvalue in units of the smallest; infinite if that is not positive.
fn condition(eigen: &Eigen) -> f64 {
    let (min, max) = (eigen.values.min(), eigen.values.max());
    if min > 0.0 { max / min } else { f64::INFINITY }
}

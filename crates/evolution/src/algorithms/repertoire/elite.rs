//! Elites: genotypes with the evidence of all trials that they have met.

use experiment_file::DescriptorConfig;
use serde::{Deserialize, Serialize};

use crate::Genotype;

/// One coordinate of behaviours, and its part of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Beginning of the range that the grid covers.
    pub low: f64,
    /// End of the range, above its beginning.
    pub high: f64,
    /// Number of cells, at least 1.
    pub n_cells: u32,
}

impl From<&DescriptorConfig> for Axis {
    fn from(descriptor: &DescriptorConfig) -> Self {
        let [low, high] = descriptor.range;
        Self { low, high, n_cells: descriptor.cells }
    }
}

impl Axis {
    /// The place of a value: 0 at the beginning of the range, 1 at its end.
    fn scaled(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// The index of the cell of a value. Values beyond the range belong to the cells at its ends.
    pub fn cell(&self, value: f64) -> u32 {
        let place = self.scaled(value) * f64::from(self.n_cells);
        (place.clamp(0.0, f64::from(self.n_cells)) as u32).min(self.n_cells - 1)
    }
}

/// An individual of a repertoire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Elite {
    /// Its genes.
    pub genotype: Genotype,
    /// The generation that first evaluated it.
    pub generation: u64,
    /// Its index in that generation.
    pub individual: u32,
    /// Number of trials that it has met in all generations.
    pub n_trials: u64,
    /// The sum of its fitness over these trials.
    fitness: f64,
    /// The sum of each descriptor over these trials.
    descriptors: Vec<f64>,
}

/// The means of an individual over all trials that it has met.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Mean fitness.
    pub fitness: f64,
    /// Mean descriptors, 0 at the beginning of their ranges and 1 at their ends.
    pub point: Vec<f64>,
    /// The cell of the mean descriptors.
    pub cell: usize,
}

impl Elite {
    /// An individual before its first trial, without its genes.
    pub fn new(generation: u64, individual: u32, n_descriptors: usize) -> Self {
        Self {
            genotype: Genotype::new(),
            generation,
            individual,
            n_trials: 0,
            fitness: 0.0,
            descriptors: vec![0.0; n_descriptors],
        }
    }

    /// Adds trials. `descriptors`: those of each trial, one trial after the other.
    pub fn add(&mut self, fitness: &[f64], descriptors: &[f64]) {
        self.n_trials += fitness.len() as u64;
        self.fitness += fitness.iter().sum::<f64>();
        for trial in descriptors.chunks_exact(self.descriptors.len().max(1)) {
            self.descriptors.iter_mut().zip(trial).for_each(|(sum, value)| *sum += value);
        }
    }

    /// Whether all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.fitness.is_finite() && self.descriptors.iter().all(|sum| sum.is_finite())
    }

    /// The generation and the index of its birth.
    pub fn born(&self) -> (u64, u32) {
        (self.generation, self.individual)
    }

    /// Mean fitness over all its trials.
    pub fn fitness(&self) -> f64 {
        self.fitness / self.n_trials as f64
    }

    /// Mean of each descriptor over all its trials.
    pub fn descriptors(&self) -> Vec<f64> {
        self.descriptors.iter().map(|sum| sum / self.n_trials as f64).collect()
    }

    /// Its means, on the grid of these axes.
    pub fn evidence(&self, axes: &[Axis]) -> Evidence {
        let means = self.descriptors();
        let cell = |cell: usize, (axis, value): (&Axis, &f64)| {
            cell * axis.n_cells as usize + axis.cell(*value) as usize
        };
        Evidence {
            fitness: self.fitness(),
            cell: axes.iter().zip(&means).fold(0, cell),
            point: axes.iter().zip(&means).map(|(axis, value)| axis.scaled(*value)).collect(),
        }
    }
}

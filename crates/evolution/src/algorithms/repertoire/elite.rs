//! Elites: genotypes with the evidence of all trials that they have met.

use std::{
    iter,
    ops::{Deref, DerefMut},
};

use experiment_file::{DescriptorConfig, limits};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

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
    descriptors: Point,
}

/// The means of an individual over all trials that it has met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Mean fitness.
    pub fitness: f64,
    /// Mean descriptors, 0 at the beginning of their ranges and 1 at their ends.
    pub point: Point,
    /// The cell of the mean descriptors.
    pub cell: usize,
}

/// The coordinates of a behaviour, or their sums. It needs no memory of its own, because a
/// generation looks at thousands of behaviours several times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    coordinates: [f64; limits::DESCRIPTORS],
    n: usize,
}

impl Deref for Point {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.coordinates[..self.n]
    }
}

impl DerefMut for Point {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.coordinates[..self.n]
    }
}

impl Serialize for Point {
    /// As a list.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Point {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = Vec::deserialize(deserializer)?;
        let n = values.len();
        let is_short = n <= limits::DESCRIPTORS;
        let point = is_short.then(|| values.into_iter().collect());
        point.ok_or_else(|| Error::invalid_length(n, &"at most 8 descriptors"))
    }
}

impl FromIterator<f64> for Point {
    /// Takes as many coordinates as there may be descriptors.
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let (mut coordinates, mut n) = ([0.0; limits::DESCRIPTORS], 0);
        for (coordinate, value) in coordinates.iter_mut().zip(values) {
            *coordinate = value;
            n += 1;
        }
        Self { coordinates, n }
    }
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
            descriptors: iter::repeat_n(0.0, n_descriptors).collect(),
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

    /// Number of its descriptors.
    pub fn n_descriptors(&self) -> usize {
        self.descriptors.len()
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
        let means: Point = self.descriptors.iter().map(|sum| sum / self.n_trials as f64).collect();
        let cell = |cell: usize, (axis, &value): (&Axis, &f64)| {
            let of_earlier = cell.saturating_mul(axis.n_cells as usize);
            of_earlier.saturating_add(axis.cell(value) as usize)
        };
        // No grid has more cells, but a state that a stranger made might claim so.
        let cell_max = limits::ELITES as usize - 1;
        Evidence {
            fitness: self.fitness(),
            cell: axes.iter().zip(&*means).fold(0, cell).min(cell_max),
            point: axes.iter().zip(&*means).map(|(axis, value)| axis.scaled(*value)).collect(),
        }
    }
}

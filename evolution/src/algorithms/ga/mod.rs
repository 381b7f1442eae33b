//! Genetic algorithm with real genes.
//!
//! The thesis's section 2.2.1; Eiben, Smith: "Introduction to evolutionary
//! computing" (2nd ed., 2015) for the operators in general, each operator's own
//! source beside it.

mod crossover;
mod mutation;
mod selection;

use experiment_file::{GaParams, MatingOperator};
use numeric::random::Stream;
use serde::{Deserialize, Serialize};

use super::{Sample, Strategy, Unsuitable};
use crate::Genotype;
use crossover::Crossover;
use mutation::Mutation;
use selection::Selection;

/// The operators, and the last generation as far as its fitness is finite: whoever
/// has none is neither elite nor parent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ga {
    d: usize,
    n_elite: usize,
    selection: Selection,
    crossover: Crossover,
    crossover_prob: f64,
    mutation: Mutation,
    mutation_prob: f64,
    /// Best first; empty before the first generation.
    ranked: Vec<Genotype>,
    /// Of `ranked`.
    fitness: Vec<f64>,
}

impl Ga {
    /// The start over `d` genes. There must be room for children beside the elite.
    pub fn new(params: &GaParams, d: usize, population_size: usize) -> Result<Self, Unsuitable> {
        let n_elite = params.num_elite as usize;
        if n_elite >= population_size {
            return Err(Unsuitable::OnlyElite { n_elite, population_size });
        }
        // The only operator there is: pairs are neighbours of a shuffled list.
        let MatingOperator::Random = params.mating_operator;
        Ok(Self {
            d,
            n_elite,
            selection: Selection::new(params),
            crossover: Crossover::new(params),
            crossover_prob: params.crossover_prob,
            mutation: Mutation::new(params),
            mutation_prob: params.mutation_prob,
            ranked: Vec::new(),
            fitness: Vec::new(),
        })
    }

    /// The elite, then children. Each phase draws for all individuals before the
    /// next one begins.
    fn breed(&self, population_size: usize, rng: &mut Stream) -> Vec<Genotype> {
        let mut population: Vec<Genotype> =
            self.ranked.iter().take(self.n_elite).cloned().collect();
        let n_children = population_size - population.len();
        let mut parents = self.selection.select(n_children, &self.fitness, rng);
        shuffle(&mut parents, rng);
        let mut children = Vec::with_capacity(n_children);
        for pair in parents.chunks(2) {
            match *pair {
                [a, b] if rng.bernoulli(self.crossover_prob) => {
                    children.extend(self.crossover.cross(&self.ranked[a], &self.ranked[b], rng));
                }
                _ => children.extend(pair.iter().map(|&parent| self.ranked[parent].clone())),
            }
        }
        for child in &mut children {
            self.mutation.mutate(child, self.mutation_prob, rng);
            child.iter_mut().for_each(|gene| *gene = gene.clamp(0.0, 1.0));
        }
        population.extend(children);
        population
    }
}

impl Strategy for Ga {
    /// The first generation is U(0, 1)^d. Later ones: the elite unchanged, then
    /// children of selected parents; a pair that does not cross, and an odd parent
    /// out, is its own children; every child mutates and is clipped to \[0, 1\].
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let genotypes = if self.ranked.is_empty() {
            (0..population_size).map(|_| (0..self.d).map(|_| rng.uniform()).collect()).collect()
        } else {
            self.breed(population_size, rng)
        };
        Sample::new(genotypes, Vec::new())
    }

    fn learn(&mut self, sample: &Sample, ranking: &[usize], fitness: &[f64]) {
        let finite = || ranking.iter().filter(|&&i| fitness[i].is_finite());
        self.ranked = finite().map(|&i| sample.genotypes[i].clone()).collect();
        self.fitness = finite().map(|&i| fitness[i]).collect();
    }
}

/// A uniformly random permutation (Fisher, Yates).
fn shuffle(items: &mut [usize], rng: &mut Stream) {
    for i in (1..items.len()).rev() {
        items.swap(i, rng.below(i + 1));
    }
}

#[cfg(test)]
mod tests;

//! Genetic algorithm with real genes.
//!
//! Section 2.2.1 of the thesis; Eiben, Smith: "Introduction to evolutionary computing" (2nd ed.,
//! 2015) for the operators in general. Each operator names its own source.

mod crossover;
mod mutation;
mod selection;

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::{Described, Sample, Strategy};
use crate::{Birth, Genotype, Parents};
use crossover::Crossover;
use mutation::Mutation;
use selection::Selection;

/// The operators, and the individuals of the last generation with finite fitness. Individuals
/// without finite fitness become neither elite nor parents.
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
    /// Fitness of `ranked`.
    fitness: Vec<f64>,
}

/// Pairs are neighbours in a shuffled list, the only operator so far.
const MATING_OPERATOR: Parameter =
    Parameter::one_of("mating_operator", &["random"], &[], "How parents are paired");
const CROSSOVER_PROB: Parameter =
    Parameter::unit("crossover_prob", 0.9, "Probability that a pair is crossed");
const MUTATION_PROB: Parameter =
    Parameter::unit("mutation_prob", 0.05, "Probability that a gene mutates");
const NUM_ELITE: Parameter = Parameter::below_population_size(
    "num_elite",
    3,
    "Individuals that survive unchanged, fewer than `population_size`",
);

impl Described for Ga {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "GA",
        title: "Genetic algorithm",
        learns: "population",
        state: "P d",
        keeps: Keeps::Population,
        individuals_min: 1,
        learns_from: LearnsFrom::Ranks,
        genes_max: None,
        parameters: &[
            selection::OPERATOR,
            selection::TOURNAMENT_SIZE,
            MATING_OPERATOR,
            crossover::OPERATOR,
            crossover::ALPHA,
            CROSSOVER_PROB,
            mutation::OPERATOR,
            MUTATION_PROB,
            mutation::SIGMA,
            mutation::CATEGORIES,
            NUM_ELITE,
        ],
    };

    fn start(params: &Params, d: usize) -> Self {
        Self {
            d,
            n_elite: params.value_of::<u32>(&NUM_ELITE) as usize,
            selection: Selection::new(params),
            crossover: Crossover::new(params),
            crossover_prob: params.value_of(&CROSSOVER_PROB),
            mutation: Mutation::new(params),
            mutation_prob: params.value_of(&MUTATION_PROB),
            ranked: Vec::new(),
            fitness: Vec::new(),
        }
    }
}

impl Ga {
    /// The elite, then children, all with their parents. Each phase draws for all individuals
    /// before the next phase begins.
    fn breed(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Parents)> {
        let elite = self.ranked.iter().take(self.n_elite).enumerate();
        let mut population: Vec<(Genotype, Parents)> =
            elite.map(|(rank, genes)| (genes.clone(), Parents::Elite(rank))).collect();
        let n_children = population_size - population.len();
        let mut parents = self.selection.select(n_children, &self.fitness, rng);
        shuffle(&mut parents, rng);
        let mut children = Vec::with_capacity(n_children);
        for pair in parents.chunks(2) {
            match *pair {
                [a, b] if rng.bernoulli(self.crossover_prob) => {
                    let crossed = self.crossover.cross(&self.ranked[a], &self.ranked[b], rng);
                    children.extend(crossed.map(|genes| (genes, Parents::Two(a, b))));
                }
                _ => children
                    .extend(pair.iter().map(|&one| (self.ranked[one].clone(), Parents::One(one)))),
            }
        }
        for (child, _) in &mut children {
            self.mutation.mutate(child, self.mutation_prob, rng);
            child.iter_mut().for_each(|gene| *gene = gene.clamp(0.0, 1.0));
        }
        population.extend(children);
        population
    }

    /// The first generation, U(0, 1)^d.
    fn begin(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Parents)> {
        let mut genes = || (0..self.d).map(|_| rng.uniform()).collect();
        (0..population_size).map(|_| (genes(), Parents::None)).collect()
    }

    fn draw(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Parents)> {
        match self.ranked.is_empty() {
            true => self.begin(population_size, rng),
            false => self.breed(population_size, rng),
        }
    }
}

impl Strategy for Ga {
    fn n_genes(&self) -> usize {
        self.d
    }

    /// The first generation is U(0, 1)^d. Later generations have the elite unchanged, and then
    /// children of selected parents. A pair that does not cross, and an unpaired parent, are
    /// copied. Every child mutates, and is clipped to \[0, 1\].
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let drawn = self.draw(population_size, rng).into_iter();
        let genotypes = drawn.map(|(genes, _)| genes).collect();
        Sample::new(genotypes, Vec::new())
    }

    fn births(&self, population_size: usize, rng: &mut Stream) -> Option<Vec<Birth>> {
        let drawn = self.draw(population_size, rng).into_iter();
        let birth = |(genes, parents): (Genotype, Parents)| {
            let ranks = match parents {
                Parents::Elite(rank) | Parents::One(rank) => vec![rank],
                Parents::Two(a, b) => vec![a, b],
                _ => Vec::new(),
            };
            let of_parents: Vec<&Genotype> = ranks.iter().map(|&rank| &self.ranked[rank]).collect();
            Birth::new(parents, &genes, &of_parents)
        };
        Some(drawn.map(birth).collect())
    }

    fn learn(&mut self, sample: &Sample, ranking: &[usize], fitness: &[f64]) {
        let finite = ranking.iter().filter(|&&i| fitness[i].is_finite());
        self.fitness.clear();
        self.fitness.extend(finite.clone().map(|&i| fitness[i]));
        // The new genotypes take the memory of the former ones.
        self.ranked.resize_with(self.fitness.len(), Vec::new);
        for (ranked, &i) in self.ranked.iter_mut().zip(finite) {
            ranked.clone_from(&sample.genotypes[i]);
        }
    }
}

/// A uniformly random permutation (Fisher, Yates).
pub fn shuffle(items: &mut [usize], rng: &mut Stream) {
    for i in (1..items.len()).rev() {
        items.swap(i, rng.below(i + 1));
    }
}

#[cfg(test)]
mod tests;

//! Lineages: the ancestors of an individual of a genetic algorithm, a repertoire or a front, and
//! the survival of their genes.
//!
//! Lineages are not stored: redrawing a generation from the state before it gives the parents of
//! each child, and the genes that the child has from each.

use std::collections::BTreeMap;

use super::{Evolution, Genotype, Told, distribution::stream_of, mean, ranking::ranking};

/// The parents of an individual: in genetic algorithms by rank in the previous generation, 0 for
/// the best; in repertoires and fronts by generation and index of their own birth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parents {
    /// No parents, in the first generation.
    None,
    /// One individual, copied unchanged.
    Elite(usize),
    /// One parent, without crossover.
    One(usize),
    /// Two crossed parents.
    Two(usize, usize),
    /// This elite, evaluated again.
    Again((u64, u32)),
    /// A point near the line through two elites, closest to the first.
    Line((u64, u32), (u64, u32)),
    /// This individual of a front, mutated.
    Mutated((u64, u32)),
    /// Two crossed individuals of a front, mutated.
    Crossed((u64, u32), (u64, u32)),
}

/// The origin of a gene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GeneSource {
    /// The first parent has the same gene.
    First,
    /// Only the second parent has the same gene.
    Second,
    /// No parent has the same gene: it mutated, or blends both parents.
    New,
}

/// The birth of an individual.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Birth {
    /// Its parents.
    pub parents: Parents,
    /// The origin of each gene.
    pub sources: Vec<GeneSource>,
}

impl Birth {
    /// The birth of an individual with these genes; `of_parents`: the genes of each parent.
    pub(crate) fn new(parents: Parents, genes: &[f64], of_parents: &[&Genotype]) -> Self {
        let [first, second] = [0, 1].map(|nth| of_parents.get(nth).copied());
        let has = |of: Option<&Genotype>, j: usize| {
            of.is_some_and(|of| of[j].to_bits() == genes[j].to_bits())
        };
        let source = |j| match () {
            () if has(first, j) => GeneSource::First,
            () if has(second, j) => GeneSource::Second,
            () => GeneSource::New,
        };
        Self { parents, sources: (0..genes.len()).map(source).collect() }
    }
}

/// An individual in a lineage: the traced individual itself, or one of its ancestors.
#[derive(Debug, Clone, PartialEq)]
pub struct Ancestor {
    /// Its generation.
    pub generation: u64,
    /// Its index in that generation.
    pub individual: u32,
    /// Its mean fitness.
    pub fitness: f64,
    /// Its birth; `None` in the earliest generation of the lineage.
    pub birth: Option<BirthOf>,
    /// Number of genes that the traced individual still has from it, by descent.
    pub n_surviving: usize,
}

/// A birth, with parents by their indices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BirthOf {
    /// The operator.
    pub operator: Operator,
    /// Each parent.
    pub parents: Vec<Parent>,
    /// Number of genes that mutated or blend both parents.
    pub n_new: usize,
}

/// A parent, and what a child has from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parent {
    /// Its generation: the previous one, or that of its birth in a repertoire or a front.
    pub generation: u64,
    /// Its index in that generation.
    pub individual: u32,
    /// Number of genes that the child has from it.
    pub n_genes: usize,
}

/// The operator that made a genotype.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    /// Drawn at random, for the first generation.
    First,
    /// Kept unchanged.
    Elite,
    /// A parent that was not crossed, mutated.
    Copy,
    /// Two parents crossed, then mutated.
    Crossover,
    /// A point drawn near the line through two elites.
    Line,
}

/// The children of a generation, and their parents.
#[derive(Debug, Clone, PartialEq)]
pub struct Families {
    /// Mean fitness of each individual of the previous generation.
    pub parents: Vec<f64>,
    /// Mean fitness of each child.
    pub children: Vec<f64>,
    /// The birth of each child per population, because each population has its own parents.
    pub births: Vec<Vec<BirthOf>>,
}

/// The births of some generations in one population, from which lineages are traced.
#[derive(Debug, Clone, Default)]
pub struct Pedigree {
    first: u64,
    /// Births and fitness of each generation from `first` on; the first one has no births.
    generations: Vec<(Vec<Birth>, Vec<f64>)>,
}

impl Evolution {
    /// The births of the next generation, per population; `None` if a population is drawn from a
    /// distribution, without parents.
    pub fn births(&self) -> Option<Vec<Vec<Birth>>> {
        let births = self.populations.iter().enumerate().map(|(idx, population)| {
            let mut rng = stream_of(self.seed, self.n_generations, idx as u64);
            population.births(self.population_size, &mut rng)
        });
        births.collect()
    }

    /// The families of the next generation; `None` unless all parents are of the latest one.
    /// `before`, `told`: the fitness of the latest and of the next generation.
    pub fn families(&self, before: &Told, told: &Told) -> Option<Families> {
        if self.behaviours().is_some() {
            return None;
        }
        let latest = self.n_generations.saturating_sub(1);
        let parents = mean_fitness(before);
        let individual_of = ranked(&parents);
        let by_index = |births: Vec<Birth>| {
            let parents = |birth: &Birth| parents_of(birth, latest, &individual_of);
            births.iter().map(|birth| birth_of(birth, parents(birth))).collect()
        };
        let births = self.births()?.into_iter().map(by_index).collect();
        Some(Families { parents, children: mean_fitness(told), births })
    }
}

impl Pedigree {
    /// An empty pedigree, before generation `first`.
    pub fn starting_at(first: u64) -> Self {
        Self { first, generations: Vec::new() }
    }

    /// Adds the next generation: its births and its fitness.
    pub fn push(&mut self, births: Vec<Birth>, told: &Told) {
        self.generations.push((births, mean_fitness(told)));
    }

    /// The lineage of an individual of the latest generation: itself first, then its ancestors,
    /// later generations first.
    pub fn trace(&self, individual: u32) -> Vec<Ancestor> {
        let mut ancestors = Vec::new();
        // The genes that are still traced, per individual of each generation.
        let mut traced: BTreeMap<u64, BTreeMap<u32, Vec<usize>>> = BTreeMap::new();
        if let Some((births, _)) = self.generations.last() {
            let birth = births.get(individual as usize);
            let genes = (0..birth.map_or(0, |birth| birth.sources.len())).collect();
            let latest = self.first + self.generations.len() as u64 - 1;
            traced.entry(latest).or_default().insert(individual, genes);
        }
        for (place, (births, fitness)) in self.generations.iter().enumerate().rev() {
            let generation = self.first + place as u64;
            let individual_of = match place.checked_sub(1) {
                Some(earlier) => ranked(&self.generations[earlier].1),
                None => Vec::new(),
            };
            for (individual, genes) in traced.remove(&generation).unwrap_or_default() {
                let birth = (place > 0 || self.first == 0)
                    .then(|| births.get(individual as usize))
                    .flatten();
                let birth = birth.map(|birth| {
                    let parents = parents_of(birth, generation.saturating_sub(1), &individual_of);
                    for (nth, parent) in parents.iter().enumerate() {
                        let source = [GeneSource::First, GeneSource::Second][nth];
                        let kept = genes.iter().filter(|&&j| birth.sources[j] == source);
                        let before = traced.entry(parent.generation).or_default();
                        before.entry(parent.individual).or_default().extend(kept);
                    }
                    birth_of(birth, parents)
                });
                ancestors.push(Ancestor {
                    generation,
                    individual,
                    fitness: fitness[individual as usize],
                    birth,
                    n_surviving: genes.len(),
                });
            }
        }
        ancestors
    }
}

/// The mean fitness of each individual over the trials.
fn mean_fitness(told: &Told) -> Vec<f64> {
    told.trial_fitness.iter().map(|trials| mean(trials)).collect()
}

/// The individuals with finite fitness, best first; only they have children.
fn ranked(fitness: &[f64]) -> Vec<u32> {
    let finite = ranking(fitness).into_iter().filter(|&i| fitness[i].is_finite());
    finite.map(|i| i as u32).collect()
}

/// `latest`: the generation of parents that are named by rank.
fn parents_of(birth: &Birth, latest: u64, individual_of: &[u32]) -> Vec<Parent> {
    let n_from =
        |source| birth.sources.iter().filter(|&&gene_source| gene_source == source).count();
    let sources = [GeneSource::First, GeneSource::Second];
    let ranks = |ranks: &[usize]| ranks.iter().map(|&rank| (latest, individual_of[rank])).collect();
    let born: Vec<(u64, u32)> = match birth.parents {
        Parents::None => Vec::new(),
        Parents::Elite(rank) | Parents::One(rank) => ranks(&[rank]),
        Parents::Two(a, b) => ranks(&[a, b]),
        Parents::Again(one) | Parents::Mutated(one) => vec![one],
        // An individual may be drawn twice.
        Parents::Line(a, b) | Parents::Crossed(a, b) if a == b => vec![a],
        Parents::Line(a, b) | Parents::Crossed(a, b) => vec![a, b],
    };
    let parent = |((generation, individual), source)| Parent {
        generation,
        individual,
        n_genes: n_from(source),
    };
    born.into_iter().zip(sources).map(parent).collect()
}

fn birth_of(birth: &Birth, parents: Vec<Parent>) -> BirthOf {
    let operator = match birth.parents {
        Parents::None => Operator::First,
        Parents::Elite(_) | Parents::Again(_) => Operator::Elite,
        Parents::One(_) | Parents::Mutated(_) => Operator::Copy,
        Parents::Two(..) | Parents::Crossed(..) => Operator::Crossover,
        Parents::Line(..) => Operator::Line,
    };
    let n_new = birth.sources.iter().filter(|&&source| source == GeneSource::New).count();
    BirthOf { operator, parents, n_new }
}

//! Evolution as ask/tell: which genotypes to judge next, and what their fitness
//! teaches.
//!
//! [`Evolution`] does the bookkeeping that all algorithms share: statistics,
//! champion, digest, the policy for fitness that is not finite. An algorithm
//! only samples and updates.
//!
//! Between `tell` and `ask` all there is to know is the serialisable
//! [`Evolution`] itself. `ask` is a pure function of it, so whoever restores a
//! checkpoint asks the same genotypes again.

mod algorithms;
mod champion;
mod digest;
mod ranking;
mod statistics;

use std::{ops::Range, sync::Arc};

use experiment_file::{ConfigError, ExperimentConfig, Problem};
use numeric::random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

pub use champion::{Champion, HeldOut, Origin, Reevaluation};
pub use digest::Digest;
pub use statistics::Statistics;

use algorithms::{Algorithm, Sample, Strategy as _, Unsuitable};

/// Genes in \[0, 1\].
pub type Genotype = Vec<f64>;

/// One genotype per individual. A large population takes tens of megabytes, so it
/// is shared, not copied.
pub type Population = Arc<[Genotype]>;

/// An experiment's evolution, after some number of generations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    seed: u64,
    population_size: usize,
    /// Generations told so far; also the index of the next one to ask.
    n_generations: u64,
    /// One algorithm per population; it evolves the population's segment of the
    /// genotype.
    populations: Vec<Algorithm>,
    champion: Option<Champion>,
    /// The best individual since the last re-evaluation.
    challenger: Option<Champion>,
    digest: Digest,
    /// Covers every re-evaluation so far, and the generations before it.
    champion_digest: Digest,
}

/// A generation to be judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Index of the generation, from 0.
    pub generation: u64,
    /// Whole genotypes.
    pub genotypes: Population,
    /// Per population.
    samples: Vec<Sample>,
}

/// What became of a generation.
#[derive(Debug, Clone, PartialEq)]
pub struct GenerationRecord {
    /// Index of the generation, from 0.
    pub generation: u64,
    /// Over the individuals whose fitness is finite.
    pub statistics: Statistics,
    /// Individuals whose fitness is not finite; they rank last.
    pub n_non_finite: usize,
    /// Link of the digest chain.
    pub digest: Digest,
}

/// Why evolution cannot go on.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EvolutionError {
    /// There is nothing to learn from.
    #[error(
        "no individual of generation {generation} has a finite fitness; \
         the fitness function or the bounds of the genotype need a look"
    )]
    NoFiniteFitness {
        /// Index of the generation.
        generation: u64,
    },
}

impl Evolution {
    /// The start of an evolution. `segments`: the genes of each population, in
    /// the order of `algorithm.populations`. Reports every population that its
    /// algorithm cannot evolve. `simulation`: the fingerprint of what computes
    /// fitness; it is part of the digest.
    pub fn new(
        config: &ExperimentConfig,
        segments: &[Range<usize>],
        simulation: &str,
    ) -> Result<Self, ConfigError> {
        let population_size = config.algorithm.population_size as usize;
        let mut populations = Vec::new();
        let mut problems = Vec::new();
        for ((name, population), segment) in config.algorithm.populations.iter().zip(segments) {
            let (params, d) = (&population.params, segment.len());
            match Algorithm::new(config.algorithm.name, params, d, population_size) {
                Ok(algorithm) => populations.push(algorithm),
                Err(unsuitable) => problems.push(problem(name, &unsuitable)),
            }
        }
        // What concerns the whole experiment would be said once per population.
        problems.dedup();
        if !problems.is_empty() {
            return Err(ConfigError { problems });
        }
        Ok(Self {
            seed: config.seed,
            population_size,
            n_generations: 0,
            populations,
            champion: None,
            challenger: None,
            digest: Digest::of_config(config, simulation),
            champion_digest: Digest::default(),
        })
    }

    /// Generations told so far.
    pub fn n_generations(&self) -> u64 {
        self.n_generations
    }

    /// The champion so far: the best on held-out trials, or, before the first
    /// re-evaluation, the best individual of all. None before the first `tell`.
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }

    /// The last link of the generations' digest chain.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// The last link of the re-evaluations' digest chain; it covers the
    /// generations before them, too.
    pub fn champion_digest(&self) -> Digest {
        self.champion_digest
    }

    /// Draws the next generation. Asking twice gives the same.
    pub fn ask(&self) -> Asked {
        let samples: Vec<Sample> = self
            .populations
            .iter()
            .enumerate()
            .map(|(idx, population)| {
                let purpose = Purpose::Evolution;
                let mut rng = Stream::new(self.seed, self.n_generations, 0, purpose, idx as u64);
                population.sample(self.population_size, &mut rng)
            })
            .collect();
        let whole = |i: usize| {
            let parts: Vec<&[f64]> = samples.iter().map(|s| &s.genotypes[i][..]).collect();
            parts.concat()
        };
        let genotypes = match &samples[..] {
            [only] => Arc::clone(&only.genotypes),
            _ => (0..self.population_size).map(whole).collect(),
        };
        Asked { generation: self.n_generations, genotypes, samples }
    }

    /// Learns from a generation that [`ask`](Self::ask) drew.
    /// `trial_fitness[i][t]`: fitness of individual i in trial t.
    pub fn tell(
        &mut self,
        asked: Asked,
        trial_fitness: &[Vec<f64>],
    ) -> Result<GenerationRecord, EvolutionError> {
        assert_eq!(asked.generation, self.n_generations, "generations are told in order");
        assert_eq!(asked.genotypes.len(), trial_fitness.len(), "one fitness per individual");
        let generation = asked.generation;
        let fitness: Vec<f64> = trial_fitness.iter().map(|trials| mean(trials)).collect();
        let ranking = ranking::ranking(&fitness);
        let best = ranking[0];
        if !fitness[best].is_finite() {
            return Err(EvolutionError::NoFiniteFitness { generation });
        }

        for (population, sample) in self.populations.iter_mut().zip(&asked.samples) {
            population.learn(sample, &ranking, &fitness);
        }
        let best_before = self.challenger.as_ref().and_then(Champion::fitness);
        if best_before.is_none_or(|best_before| fitness[best] > best_before) {
            self.challenger = Some(Champion {
                generation,
                origin: Origin::Individual(best as u32),
                genotype: asked.genotypes[best].clone(),
                trial_fitness: trial_fitness[best].clone(),
                held_out: None,
            });
            if self.champion.as_ref().is_none_or(|champion| champion.held_out.is_none()) {
                self.champion.clone_from(&self.challenger);
            }
        }
        self.digest = self.digest.next(generation, &asked.genotypes, trial_fitness);
        self.n_generations += 1;
        Ok(GenerationRecord {
            generation,
            statistics: Statistics::of(&fitness),
            n_non_finite: fitness.iter().filter(|value| !value.is_finite()).count(),
            digest: self.digest,
        })
    }

    /// Who is to be judged on held-out trials, after the latest generation.
    pub fn reevaluation(&self) -> Option<Reevaluation> {
        let generation = self.n_generations.checked_sub(1)?;
        let incumbent = self.champion.clone().filter(|champion| champion.held_out.is_some());
        let means: Option<Vec<Genotype>> = self.populations.iter().map(Algorithm::mean).collect();
        let mean = means.map(|means| Champion {
            generation,
            origin: Origin::Mean,
            genotype: means.concat(),
            trial_fitness: Vec::new(),
            held_out: None,
        });
        let candidates = incumbent.into_iter().chain(self.challenger.clone()).chain(mean).collect();
        Some(Reevaluation { generation, candidates })
    }

    /// Makes the best of a [`reevaluation`](Self::reevaluation) the champion. If
    /// none of them has a finite fitness, the champion stays.
    pub fn crown(&mut self, reevaluation: &Reevaluation, trial_fitness: &[Vec<f64>]) {
        if let Some(champion) = reevaluation.decide(trial_fitness) {
            self.champion = Some(champion);
        }
        self.challenger = None;
        let genotypes = reevaluation.candidates.iter().map(|candidate| &candidate.genotype[..]);
        self.champion_digest =
            self.champion_digest.next_champion(self.digest, genotypes, trial_fitness);
    }
}

/// Where in the configuration, and what.
fn problem(population: &str, unsuitable: &Unsuitable) -> Problem {
    let population = format!("algorithm.populations.{population}");
    let path = match unsuitable {
        Unsuitable::NoGenes => population,
        Unsuitable::OnlyElite { .. } => format!("{population}.params.num_elite"),
        Unsuitable::TooFewIndividuals => "algorithm.population_size".to_owned(),
        Unsuitable::TooManyGenes { .. } => "algorithm.name".to_owned(),
    };
    Problem { path, line: None, message: unsuitable.to_string() }
}

/// Plain mean, summed in order.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests;

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

mod digest;
mod ranking;
mod snes;
mod statistics;

use std::ops::Range;

use serde::{Deserialize, Serialize};
use sim_core::{
    config::{AlgorithmParams, ConfigError, ExperimentConfig, PopulationConfig, Problem},
    random::{Purpose, Stream},
};

pub use digest::Digest;
pub use statistics::Statistics;

use snes::Snes;

/// Genes in \[0, 1\].
pub type Genotype = Vec<f64>;

/// An experiment's evolution, after some number of generations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evolution {
    seed: u64,
    population_size: usize,
    /// Generations told so far; also the index of the next one to ask.
    n_generations: u64,
    populations: Vec<Population>,
    champion: Option<Champion>,
    digest: Digest,
}

/// One population: the algorithm that evolves one segment of the genotype.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Population {
    segment: Range<usize>,
    algorithm: Algorithm,
}

/// The algorithms, each with its state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Algorithm {
    Snes(Snes),
}

/// What an algorithm draws for one generation.
#[derive(Debug, Clone, PartialEq)]
struct Sample {
    /// Genes of each individual, within \[0, 1\].
    genotypes: Vec<Genotype>,
    /// The standard normal draws behind them, for algorithms that learn from
    /// those.
    normals: Vec<Vec<f64>>,
}

/// A generation to be judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Asked {
    /// Index of the generation, from 0.
    pub generation: u64,
    /// Whole genotypes, one per individual.
    pub genotypes: Vec<Genotype>,
    /// Per population.
    samples: Vec<Sample>,
}

/// The best individual so far, by its mean fitness over the trials it met.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Champion {
    /// Generation it lived in.
    pub generation: u64,
    /// Its index there.
    pub individual: u32,
    /// Mean of `trial_fitness`.
    pub fitness: f64,
    /// One value per trial.
    pub trial_fitness: Vec<f64>,
    /// Its genes.
    pub genotype: Genotype,
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
    /// Whether the champion is of this generation.
    pub has_new_champion: bool,
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
    /// the order of `algorithm.populations`.
    pub fn new(config: &ExperimentConfig, segments: &[Range<usize>]) -> Result<Self, ConfigError> {
        let populations = config.algorithm.populations.values().zip(segments);
        Ok(Self {
            seed: config.seed,
            population_size: config.algorithm.population_size as usize,
            n_generations: 0,
            populations: populations
                .map(|(population, segment)| Population::new(config, population, segment.clone()))
                .collect::<Result<_, _>>()?,
            champion: None,
            digest: Digest::of_config(config),
        })
    }

    /// Generations told so far.
    pub fn n_generations(&self) -> u64 {
        self.n_generations
    }

    /// The best individual so far; none before the first `tell`.
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }

    /// The digest chain's last link.
    pub fn digest(&self) -> Digest {
        self.digest
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
                population.algorithm.sample(self.population_size, &mut rng)
            })
            .collect();
        let genotypes = (0..self.population_size)
            .map(|i| samples.iter().flat_map(|sample| &sample.genotypes[i]).copied().collect())
            .collect();
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
            population.algorithm.learn(sample, &ranking);
        }
        let has_new_champion =
            self.champion.as_ref().is_none_or(|champion| fitness[best] > champion.fitness);
        if has_new_champion {
            self.champion = Some(Champion {
                generation,
                individual: best as u32,
                fitness: fitness[best],
                trial_fitness: trial_fitness[best].clone(),
                genotype: asked.genotypes[best].clone(),
            });
        }
        self.digest = self.digest.next(generation, &asked.genotypes, trial_fitness);
        self.n_generations += 1;
        Ok(GenerationRecord {
            generation,
            statistics: Statistics::of(&fitness),
            n_non_finite: fitness.iter().filter(|value| !value.is_finite()).count(),
            digest: self.digest,
            has_new_champion,
        })
    }
}

impl Population {
    fn new(
        config: &ExperimentConfig,
        population: &PopulationConfig,
        segment: Range<usize>,
    ) -> Result<Self, ConfigError> {
        let algorithm = match &population.params {
            AlgorithmParams::Snes(params) => Algorithm::Snes(Snes::new(params, segment.len())),
            AlgorithmParams::Ga(_)
            | AlgorithmParams::Xnes(_)
            | AlgorithmParams::CmaEs(_)
            | AlgorithmParams::OpenAiEs(_) => {
                return Err(ConfigError {
                    problems: vec![Problem {
                        path: "algorithm.name".to_owned(),
                        line: None,
                        message: format!(
                            "{:?} is not supported; use \"SNES\"",
                            config.algorithm.name
                        ),
                    }],
                });
            }
        };
        Ok(Self { segment, algorithm })
    }
}

impl Algorithm {
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        match self {
            Self::Snes(snes) => snes.sample(population_size, rng),
        }
    }

    fn learn(&mut self, sample: &Sample, ranking: &[usize]) {
        match self {
            Self::Snes(snes) => snes.learn(sample, ranking),
        }
    }
}

/// Plain mean, summed in order.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests;

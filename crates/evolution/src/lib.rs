//! Evolutionary algorithms as ask and tell, reproducible to the bit.
//!
//! [`Evolution`] draws a generation of genotypes ([`ask`](Evolution::ask)), you
//! compute their fitness, and it learns from that ([`tell`](Evolution::tell)):
//!
//! ```
//! use evolution::Setup;
//!
//! /// Largest where every gene is 0.3.
//! fn sphere(genes: &[f64]) -> f64 {
//!     -genes.iter().map(|gene| (gene - 0.3) * (gene - 0.3)).sum::<f64>()
//! }
//!
//! let setup = Setup { population_size: 20, seed: 7, ..Setup::new("SNES", 10) };
//! let mut evolution = setup.start()?;
//! for _ in 0..200 {
//!     let generation = evolution.ask();
//!     // One number per trial; a function without noise needs one trial.
//!     let fitness: Vec<Vec<f64>> =
//!         generation.genotypes.iter().map(|genes| vec![sphere(genes)]).collect();
//!     evolution.tell(generation, &fitness)?;
//! }
//! let champion = evolution.champion().expect("200 generations have a champion");
//! assert!(champion.genotype.iter().all(|gene| (gene - 0.3).abs() < 1e-3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Genes lie in \[0, 1\], larger fitness is better, and a fitness that is not
//! finite ranks last. [`ALGORITHMS`] lists the algorithms with their parameters and
//! limits; `docs/algorithms.md` has their formulas and sources.
//!
//! - [`Setup`] starts an evolution of one population for any function; [`Evolution::new`] starts
//!   the evolution of an experiment file, which may have several populations (cooperative
//!   coevolution).
//! - [`Evolution::ask`] is a pure function of the state, so an evolution restored from a
//!   [`Checkpoint`] draws the same genotypes as the stored one.
//! - Every random draw has an address (seed, generation, population), so results do
//!   not depend on machine, threads or time. [`Evolution::digest`] is a hash of all
//!   genotypes and fitness so far: equal digests mean equal runs, bit for bit.
//! - The best of noisy evaluations is optimistic. [`Evolution::reevaluation`] names candidates to
//!   evaluate again on held-out trials, and [`Evolution::set_champion`] keeps the best of them. At
//!   the end of a run, [`Evolution::judgement`] measures the champion's honest fitness, on trials
//!   that selected nothing.
//! - [`Round`] is the next batch of a run of an experiment file, in this order.
//!
//! An algorithm only samples and updates. All algorithms share statistics, champion, digest and the
//! rule for fitness that is not finite.

mod algorithms;
mod champion;
mod checkpoint;
mod digest;
mod distribution;
mod dominance;
mod dynamics;
mod fork;
mod front;
mod hypervolume;
pub mod interval;
mod judgement;
mod lineage;
mod ranking;
mod real;
mod reevaluation;
mod repertoire;
mod repetition;
mod round;
mod setup;
mod stall;
mod statistics;
mod told;
mod wire;

use std::{ops::Range, sync::Arc};

use experiment_file::ExperimentConfig;
use serde::{Deserialize, Serialize};

pub use algorithms::{ALGORITHMS, Axis};
pub use champion::{Champion, ChampionSource, HeldOut, Judged};
pub use checkpoint::{Checkpoint, CheckpointError};
pub use digest::{Digest, NextLink};
pub use distribution::Distribution;
pub use dynamics::Dynamics;
pub use experiment_file::{Direction, Params};
pub use fork::{Fork, ForkError};
pub use front::{Front, FrontFigures};
pub use judgement::Judgement;
pub use lineage::{
    Ancestor, Birth, BirthOf, Families, GeneSource, Operator, Parent, Parents, Pedigree,
};
pub use real::{NotANumber, Real};
pub use reevaluation::Reevaluation;
pub use repertoire::{Corrected, EliteReport, JudgedElite, Repertoire};
pub use repetition::{Evaluated, Outcome, Repeated};
pub use round::{Concluded, Next, Round, completion};
pub use setup::{Setup, SetupError};
pub use stall::{Drifted, FLAT_COUNTED_MAX, Learnt};
pub use statistics::{Statistics, between, deviation, finite_mean};
pub use told::{End, Evaluations, Told};

use algorithms::{Algorithm, BesideFitness, Lesson, Sample};
use distribution::stream_of;
use stall::FlatGenerations;

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
    /// Number of generations told so far; also the index of the next one.
    n_generations: u64,
    /// One algorithm per population; it evolves the population's segment of the
    /// genotype.
    populations: Vec<Algorithm>,
    champion: Option<Champion>,
    /// The best individual since the last re-evaluation.
    challenger: Option<Champion>,
    digest: Digest,
    /// The last link of the re-evaluations' chain, which covers the generations before the latest
    /// re-evaluation.
    champion_digest: Digest,
    #[serde(skip)]
    n_flat: FlatGenerations,
}

/// A generation of genotypes, whose fitness the caller computes.
#[derive(Debug, Clone, PartialEq)]
pub struct Generation {
    /// Index of the generation, from 0.
    pub index: u64,
    /// The genotypes of all individuals, each with the segments of all populations; shape
    /// `[individual][gene]`.
    pub genotypes: Population,
    /// The draws of each population's algorithm, in the order of the segments.
    samples: Vec<Sample>,
    link: Arc<NextLink>,
}

impl Generation {
    /// The generation's link of the digest chain, for a thread that hashes the genes while the
    /// generation is evaluated.
    pub fn link(&self) -> Arc<NextLink> {
        Arc::clone(&self.link)
    }
}

/// A summary of the fitness of a generation.
#[derive(Debug, Clone, PartialEq)]
pub struct GenerationSummary {
    /// Index of the generation, from 0.
    pub generation: u64,
    /// Statistics over the individuals with finite fitness.
    pub statistics: Statistics,
    /// Number of individuals without finite fitness; they rank last.
    pub n_non_finite: usize,
    /// Number of latest generations, including this one, in which all individuals had the same
    /// fitness; 0 if this generation has different fitness.
    pub n_flat: u64,
    /// Link of the digest chain.
    pub digest: Digest,
}

/// Why evolution cannot learn from a generation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EvolutionError {
    /// No individual has a finite fitness. The fitness function or the bounds of
    /// the genotype have to change.
    #[error(
        "no individual of generation {generation} has a finite fitness; \
         check the fitness function and the bounds of the genotype"
    )]
    NoFiniteFitness {
        /// Index of the generation.
        generation: u64,
    },
    /// Evolution learns nothing, and its distribution is far wider than the genes' range. Only
    /// [`Evolution::learn`] returns this; [`Evolution::tell`] never does, so that recorded
    /// generations can always be told again.
    #[error(transparent)]
    Drifted(#[from] Drifted),
}

impl Evolution {
    /// The evolution of an experiment before its first generation. `segments`: the range of genes
    /// of each population, in the order of `algorithm.populations`, none of them empty.
    /// `simulation`: the fingerprint of the code that computes fitness, which is part of the
    /// digest.
    ///
    /// # Panics
    ///
    /// If `config` names an algorithm that is not among [`ALGORITHMS`]. The reader
    /// of experiment files refuses such a file.
    pub fn new(config: &ExperimentConfig, segments: &[Range<usize>], simulation: &str) -> Self {
        let algorithm = &config.algorithm;
        let beside = BesideFitness {
            axes: algorithm.descriptors.iter().map(Axis::from).collect(),
            aims: algorithm.aims.iter().map(|aim| aim.direction).collect(),
        };
        let populations = algorithm.populations.values().zip(segments);
        let populations = populations
            .map(|(population, segment)| {
                Algorithm::new(&algorithm.name, &population.params, segment.len(), &beside)
                    .expect("the reader knows the algorithm")
            })
            .collect();
        let digest = Digest::of_config(config, simulation);
        Self::from_parts(config.seed, algorithm.population_size as usize, populations, digest)
    }

    /// An evolution before its first generation; `digest`: link -1 of the chain.
    fn from_parts(
        seed: u64,
        population_size: usize,
        populations: Vec<Algorithm>,
        digest: Digest,
    ) -> Self {
        Self {
            seed,
            population_size,
            n_generations: 0,
            populations,
            champion: None,
            challenger: None,
            digest,
            champion_digest: Digest::default(),
            n_flat: FlatGenerations::default(),
        }
    }

    /// Number of generations told so far.
    pub fn n_generations(&self) -> u64 {
        self.n_generations
    }

    /// The present champion: the best candidate on held-out trials, or, before the first
    /// re-evaluation, the best individual of all generations. `None` before the first `tell`.
    pub fn champion(&self) -> Option<&Champion> {
        self.champion.as_ref()
    }

    /// The last link of the generations' digest chain.
    pub fn digest(&self) -> Digest {
        self.digest
    }

    /// The last link of the re-evaluations' digest chain, which also covers the generations
    /// before them.
    pub fn champion_digest(&self) -> Digest {
        self.champion_digest
    }

    /// Number of genes of a genotype: those of all populations.
    pub fn n_genes(&self) -> usize {
        self.populations.iter().map(Algorithm::n_genes).sum()
    }

    /// Whether both evolutions have the same seed, the same number of individuals, and
    /// populations with the same numbers of genes.
    pub fn has_shape_of(&self, other: &Self) -> bool {
        let n_genes = |evolution: &Self| {
            evolution.populations.iter().map(Algorithm::n_genes).collect::<Vec<_>>()
        };
        (self.seed, self.population_size) == (other.seed, other.population_size)
            && n_genes(self) == n_genes(other)
    }

    /// The mean of the distribution after the latest generation, as a genotype; `None` if a
    /// population's algorithm has no distribution.
    pub fn mean(&self) -> Option<Genotype> {
        let means: Option<Vec<Genotype>> = self.populations.iter().map(Algorithm::mean).collect();
        means.map(|means| means.concat())
    }

    /// Draws the next generation. Repeated calls return the same generation.
    pub fn ask(&self) -> Generation {
        let samples: Vec<Sample> = self
            .populations
            .iter()
            .enumerate()
            .map(|(idx, population)| {
                let mut rng = stream_of(self.seed, self.n_generations, idx as u64);
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
        self.generation(genotypes, samples)
    }

    /// The next generation, with these genotypes.
    fn generation(&self, genotypes: Population, samples: Vec<Sample>) -> Generation {
        let index = self.n_generations;
        let link = Arc::new(NextLink::new(self.digest, index, &genotypes));
        Generation { index, genotypes, samples, link }
    }

    /// Learns from a generation that [`ask`](Self::ask) drew. `fitness[i][t]` of the evaluations:
    /// fitness of individual i in trial t; its mean over t is the individual's fitness, and larger
    /// is better. A repertoire also learns from descriptors, and a front from the values of aims.
    ///
    /// # Errors
    ///
    /// If no individual has a finite fitness.
    ///
    /// # Panics
    ///
    /// If `generation` is not the next one, or if the evaluations do not have one row per
    /// individual, with [`n_descriptors`](Self::n_descriptors) descriptors per trial.
    pub fn tell<'a>(
        &mut self,
        generation: Generation,
        evaluations: impl Into<Evaluations<'a>>,
    ) -> Result<GenerationSummary, EvolutionError> {
        let Generation { index, genotypes, samples, link } = generation;
        let told = evaluations.into();
        let Evaluations { fitness: trial_fitness, descriptors } = told;
        assert_eq!(index, self.n_generations, "generations are told in order");
        assert_eq!(genotypes.len(), trial_fitness.len(), "one fitness per individual");
        let n_described = if self.n_descriptors() == 0 { 0 } else { genotypes.len() };
        assert_eq!(
            n_described,
            descriptors.len(),
            "descriptors for repertoires and fronts, and only for them"
        );
        let fitness = means(trial_fitness);
        let ranking = ranking::ranking(&fitness);
        let best = ranking[0];
        if !has_finite_fitness(trial_fitness) {
            return Err(EvolutionError::NoFiniteFitness { generation: index });
        }

        for (population, sample) in self.populations.iter_mut().zip(&samples) {
            let (ranking, fitness) = (&ranking[..], &fitness[..]);
            population.learn(&Lesson { generation: index, sample, ranking, fitness, told });
        }
        let best_before = self.challenger.as_ref().and_then(Champion::fitness);
        if best_before.is_none_or(|best_before| fitness[best] > best_before) {
            self.challenger = Some(Champion {
                generation: index,
                source: ChampionSource::Individual(best as u32),
                genotype: genotypes[best].clone(),
                trial_fitness: trial_fitness[best].clone(),
                held_out: None,
                judged: None,
            });
            if self.champion.as_ref().is_none_or(|champion| champion.held_out.is_none()) {
                self.champion.clone_from(&self.challenger);
            }
        }
        self.digest = link.close(self.digest, told);
        self.n_generations += 1;
        let statistics = Statistics::from_fitness(&fitness);
        let n_non_finite = fitness.iter().filter(|value| !value.is_finite()).count();
        self.n_flat = self.n_flat.next(stall::is_flat(&fitness));
        Ok(GenerationSummary {
            generation: index,
            statistics,
            n_non_finite,
            n_flat: self.n_flat.0,
            digest: self.digest,
        })
    }

    /// The candidates to evaluate on held-out trials after the latest generation; `None` before
    /// the first one.
    pub fn reevaluation(&self) -> Option<Reevaluation> {
        let generation = self.n_generations.checked_sub(1)?;
        let incumbent = self.champion.clone().filter(|champion| champion.held_out.is_some());
        let mean = self.mean().map(|genotype| Champion {
            generation,
            source: ChampionSource::Mean,
            genotype,
            trial_fitness: Vec::new(),
            held_out: None,
            judged: None,
        });
        let candidates = incumbent.into_iter().chain(self.challenger.clone()).chain(mean).collect();
        Some(Reevaluation::new(generation, candidates, self.digest, self.champion_digest))
    }

    /// Makes the winner of a finished [`reevaluation`](Self::reevaluation) the champion. If no
    /// candidate has a finite mean, the champion stays.
    pub fn set_champion(&mut self, reevaluation: &Reevaluation) {
        let (winner, digest) = reevaluation.outcome();
        if let Some(winner) = winner {
            self.champion = Some(winner.clone());
        }
        self.challenger = None;
        self.champion_digest = digest;
    }

    /// The present champion and the elites of a repertoire or of a front, to judge on trials that
    /// select nothing; `None` before the first generation. The judgement does not change evolution.
    pub fn judgement(&self) -> Option<Judgement> {
        let generation = self.n_generations.checked_sub(1)?;
        let champion = self.champion.clone()?;
        let judgement = Judgement::new(generation, champion, self.digest, self.champion_digest);
        Some(match self.behaviours() {
            Some(repertoire) => {
                let elites = repertoire.elites().into_iter().map(|elite| elite.genotype.clone());
                judgement.with_elites(elites.collect(), self.n_descriptors())
            }
            None => judgement,
        })
    }
}

/// Whether at least one individual has a finite mean fitness, without which evolution cannot
/// learn from a generation.
pub fn has_finite_fitness(trial_fitness: &[Vec<f64>]) -> bool {
    trial_fitness.iter().any(|trials| mean(trials).is_finite())
}

/// The plain mean, summed in order: the fitness of an individual with these fitnesses in its
/// trials.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean fitness of every individual over its trials.
fn means(trial_fitness: &[Vec<f64>]) -> Vec<f64> {
    trial_fitness.iter().map(|trials| mean(trials)).collect()
}

#[cfg(test)]
mod tests;

//! The judgement of a champion: its honest fitness, on trials that selected nothing.

use std::sync::Arc;

use determinism::random::TrialSet;

use super::{Champion, Digest, Population, champion::Judged, finite_mean, interval::interval};

/// A champion to judge.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    generation: u64,
    champion: Champion,
    /// The last link of the generations' digest chain, which the next link covers.
    of_generations: Digest,
    /// The last link of the chain of re-evaluations.
    digest: Digest,
}

impl Judgement {
    /// Prepares the judgement after a generation. `of_generations`, `digest`: the last links of
    /// the digest chains of generations and of re-evaluations.
    pub(crate) fn new(
        generation: u64,
        champion: Champion,
        of_generations: Digest,
        digest: Digest,
    ) -> Self {
        Self { generation, champion, of_generations, digest }
    }

    /// The trials of the judgement.
    pub fn trial_set(&self) -> TrialSet {
        TrialSet::Judgement(self.generation)
    }

    /// The champion's genotype, as a population of one.
    pub fn genotypes(&self) -> Population {
        Arc::new([self.champion.genotype.clone()])
    }

    /// The champion with its judgement, and the new last link of the digest chain of
    /// re-evaluations. `trial_fitness[0][t]`: fitness of the genotype in trial t. The champion
    /// stays without a judgement if the fitness of a trial is not finite.
    pub fn decide(self, trial_fitness: &[Vec<f64>]) -> (Champion, Digest) {
        let Self { generation, champion, of_generations, digest } = self;
        let genotype = [&champion.genotype[..]].into_iter();
        let digest = digest.next_champion(of_generations, genotype, trial_fitness);
        let values = trial_fitness.concat();
        let n_trials = values.len() as u32;
        let judged = finite_mean(&values)
            .zip(interval(&values))
            .map(|(mean, (low, high))| Judged { mean, low, high, n_trials, generation });
        (Champion { judged, ..champion }, digest)
    }
}

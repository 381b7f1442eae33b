//! The judgement of a champion: what it is worth, on trials that selected nothing.

use std::sync::Arc;

use determinism::random::TrialSet;

use super::{Champion, Digest, Population, champion::Judged, finite_mean, interval::interval};

/// A champion that is to be judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    generation: u64,
    champion: Champion,
    /// The link of the generations' digest chain on which the next one hangs.
    of_generations: Digest,
    /// The last link of the chain of re-evaluations.
    digest: Digest,
}

impl Judgement {
    /// After a generation. `of_generations`, `digest`: the last links of the digest chains
    /// of generations and of re-evaluations.
    pub(crate) fn new(
        generation: u64,
        champion: Champion,
        of_generations: Digest,
        digest: Digest,
    ) -> Self {
        Self { generation, champion, of_generations, digest }
    }

    /// Worlds and noise.
    pub fn trial_set(&self) -> TrialSet {
        TrialSet::Judgement(self.generation)
    }

    /// The champion's genotype, alone.
    pub fn genotypes(&self) -> Population {
        Arc::new([self.champion.genotype.clone()])
    }

    /// The champion with its judgement, and the last link of the digest chain of
    /// re-evaluations, which covers that, too. `trial_fitness`: of its genotype, alone.
    /// There is no judgement if the fitness of a trial is not finite.
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

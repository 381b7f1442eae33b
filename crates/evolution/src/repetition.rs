//! Repeats recorded generations, with their evaluations and results.

use std::borrow::Cow;

use determinism::random::TrialSet;

use super::{
    Champion, CheckpointError, Digest, Evolution, GenerationSummary, Population, Reevaluation, Told,
};

/// A repeated generation.
#[derive(Debug)]
pub struct Repeated<'a> {
    /// Its summary.
    pub summary: GenerationSummary,
    /// Its evaluations: the generation, then each block of the re-evaluation after it.
    pub evaluated: Vec<Evaluated<'a>>,
}

/// Genotypes that were evaluated together.
#[derive(Debug, Clone)]
pub struct Evaluated<'a> {
    /// The trials.
    pub trial_set: TrialSet,
    /// The genotypes.
    pub genotypes: Population,
    /// The recorded numbers of each genotype, for each trial its fitness and then its descriptors.
    pub values: Cow<'a, [Vec<f64>]>,
    /// Numbers per trial: 1 without descriptors.
    pub values_per_trial: usize,
}

/// The result of a run after its latest generation.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The champion, with its judgement if the run is over.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything.
    pub digest: Digest,
    /// The evaluations at the end of the run.
    pub evaluated: Vec<Evaluated<'a>>,
}

impl Evolution {
    /// Repeats a recorded generation and its re-evaluation. Evaluations at the end of a run do
    /// not change evolution.
    ///
    /// # Errors
    ///
    /// If `told` does not fit this state, or has no finite fitness.
    pub fn repeat<'a>(&mut self, told: &'a Told) -> Result<Repeated<'a>, CheckpointError> {
        let generation = self.ask();
        let misfit = CheckpointError::Misfit { generation: generation.index };
        let n_descriptors = self.n_descriptors();
        if !told.has_shape(generation.genotypes.len(), n_descriptors) {
            return Err(misfit);
        }
        let mut evaluated = vec![Evaluated {
            trial_set: TrialSet::Generation(generation.index),
            genotypes: generation.genotypes.clone(),
            values: match n_descriptors {
                0 => (&told.trial_fitness[..]).into(),
                _ => told.values().into(),
            },
            values_per_trial: 1 + n_descriptors,
        }];
        let summary = self.tell(generation, told)?;
        if !told.blocks.is_empty() {
            let reevaluation =
                self.repeat_reevaluation(&told.blocks, &mut evaluated).ok_or(misfit)?;
            self.set_champion(&reevaluation);
        }
        Ok(Repeated { summary, evaluated })
    }

    /// The result of the run, if the latest generation is its last one. `told`: the entry of that
    /// generation.
    ///
    /// # Errors
    ///
    /// If the end in `told` does not fit this state.
    pub fn outcome<'a>(&self, told: &'a Told) -> Result<Outcome<'a>, CheckpointError> {
        let generation = self.n_generations().saturating_sub(1);
        let misfit = || CheckpointError::Misfit { generation };
        let mut evaluated = Vec::new();
        let mut last = self.clone();
        let has_blocks = !told.blocks.is_empty() || !told.end.blocks.is_empty();
        if !told.end.blocks.is_empty() {
            let reevaluation =
                last.repeat_reevaluation(&told.end.blocks, &mut evaluated).ok_or_else(misfit)?;
            last.set_champion(&reevaluation);
        }
        let digest = if has_blocks { last.champion_digest() } else { last.digest() };
        if told.end.judgement.is_empty() {
            if !told.end.elites.is_empty() {
                return Err(misfit());
            }
            return Ok(Outcome { champion: last.champion().cloned(), digest, evaluated });
        }
        let judgement = last.judgement().ok_or_else(misfit)?;
        if !judgement.fits(&told.end) {
            return Err(misfit());
        }
        let new = |genotypes, values, values_per_trial| Evaluated {
            trial_set: judgement.trial_set(),
            genotypes,
            values,
            values_per_trial,
        };
        let genotypes = judgement.genotypes();
        let (champion, elites) = genotypes.split_at(1);
        evaluated.push(new(champion.into(), vec![told.end.judgement.clone()].into(), 1));
        if !elites.is_empty() {
            let values = (&told.end.elites[..]).into();
            evaluated.push(new(elites.into(), values, judgement.values_per_trial()));
        }
        let (champion, digest) = judgement.decide_by(&told.end);
        Ok(Outcome { champion: Some(champion), digest, evaluated })
    }

    /// Repeats a re-evaluation. Returns `None` if the blocks do not fit the candidates.
    fn repeat_reevaluation<'a>(
        &self,
        blocks: &'a [Vec<Vec<f64>>],
        evaluated: &mut Vec<Evaluated<'a>>,
    ) -> Option<Reevaluation> {
        let mut reevaluation = self.reevaluation()?;
        for block in blocks {
            let genotypes = reevaluation.genotypes();
            if genotypes.len() != block.len() || reevaluation.is_over() {
                return None;
            }
            let trial_set = reevaluation.trial_set();
            let values = block[..].into();
            evaluated.push(Evaluated { trial_set, genotypes, values, values_per_trial: 1 });
            reevaluation.learn(block);
        }
        reevaluation.is_over().then_some(reevaluation)
    }
}

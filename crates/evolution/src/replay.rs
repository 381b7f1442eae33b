//! Repeats recorded generations, with their evaluations and results.

use determinism::random::TrialSet;

use super::{
    Champion, CheckpointError, Digest, Evolution, GenerationSummary, Population, Reevaluation, Told,
};

/// A repeated generation.
#[derive(Debug)]
pub struct Replay<'a> {
    /// Its summary.
    pub summary: GenerationSummary,
    /// Its evaluations: the generation, then each block of the re-evaluation after it.
    pub rounds: Vec<Round<'a>>,
}

/// Genotypes that were evaluated together.
#[derive(Debug, Clone)]
pub struct Round<'a> {
    /// The trials.
    pub trial_set: TrialSet,
    /// The genotypes.
    pub genotypes: Population,
    /// The recorded fitness of each genotype in every trial; shape `[genotype][trial]`.
    pub trial_fitness: &'a [Vec<f64>],
}

/// The result of a run after its latest generation.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The champion, with its judgement if the run is over.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything.
    pub digest: Digest,
    /// The evaluations at the end of the run.
    pub rounds: Vec<Round<'a>>,
}

impl Evolution {
    /// Repeats a recorded generation and its re-evaluation. Evaluations at the end of a run do
    /// not change evolution.
    ///
    /// # Errors
    ///
    /// If `told` does not fit this state, or has no finite fitness.
    pub fn replay<'a>(&mut self, told: &'a Told) -> Result<Replay<'a>, CheckpointError> {
        let generation = self.ask();
        let misfit = CheckpointError::Misfit { generation: generation.index };
        if told.trial_fitness.len() != generation.genotypes.len() {
            return Err(misfit);
        }
        let mut rounds = vec![Round {
            trial_set: TrialSet::Generation(generation.index),
            genotypes: generation.genotypes.clone(),
            trial_fitness: &told.trial_fitness,
        }];
        let summary = self.tell(generation, &told.trial_fitness)?;
        if !told.blocks.is_empty() {
            let reevaluation = self.repeat(&told.blocks, &mut rounds).ok_or(misfit)?;
            self.set_champion(&reevaluation);
        }
        Ok(Replay { summary, rounds })
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
        let mut rounds = Vec::new();
        let mut last = self.clone();
        let has_blocks = !told.blocks.is_empty() || !told.end.blocks.is_empty();
        if !told.end.blocks.is_empty() {
            let reevaluation = last.repeat(&told.end.blocks, &mut rounds).ok_or_else(misfit)?;
            last.set_champion(&reevaluation);
        }
        let digest = if has_blocks { last.champion_digest() } else { last.digest() };
        let judged = &told.end.judgement;
        if judged.is_empty() {
            return Ok(Outcome { champion: last.champion().cloned(), digest, rounds });
        }
        let judgement = last.judgement().ok_or_else(misfit)?;
        rounds.push(Round {
            trial_set: judgement.trial_set(),
            genotypes: judgement.genotypes(),
            trial_fitness: std::slice::from_ref(judged),
        });
        let (champion, digest) = judgement.decide(std::slice::from_ref(judged));
        Ok(Outcome { champion: Some(champion), digest, rounds })
    }

    /// Repeats a re-evaluation. Returns `None` if the blocks do not fit the candidates.
    fn repeat<'a>(
        &self,
        blocks: &'a [Vec<Vec<f64>>],
        rounds: &mut Vec<Round<'a>>,
    ) -> Option<Reevaluation> {
        let mut reevaluation = self.reevaluation()?;
        for block in blocks {
            let genotypes = reevaluation.genotypes();
            if genotypes.len() != block.len() || reevaluation.is_over() {
                return None;
            }
            let trial_set = reevaluation.trial_set();
            rounds.push(Round { trial_set, genotypes, trial_fitness: block });
            reevaluation.learn(block);
        }
        reevaluation.is_over().then_some(reevaluation)
    }
}

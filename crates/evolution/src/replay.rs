//! Going through generations again: what was evaluated for each, and what came of it.

use determinism::random::TrialSet;

use super::{
    Champion, CheckpointError, Digest, Evolution, GenerationSummary, Population, Reevaluation, Told,
};

/// A generation that evolution has gone through again.
#[derive(Debug)]
pub struct Replay<'a> {
    /// What came of it.
    pub summary: GenerationSummary,
    /// What was evaluated: the generation, then each block of the re-evaluation after it.
    pub rounds: Vec<Round<'a>>,
}

/// Genotypes that were evaluated at once.
#[derive(Debug, Clone)]
pub struct Round<'a> {
    /// Which worlds and noise.
    pub trial_set: TrialSet,
    /// The genotypes.
    pub genotypes: Population,
    /// Of each its fitness in every trial, as it was told.
    pub trial_fitness: &'a [Vec<f64>],
}

/// How a run stands after its latest generation.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// The champion, with its judgement if the run is over.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything.
    pub digest: Digest,
    /// What was evaluated because the run was over.
    pub rounds: Vec<Round<'a>>,
}

impl Evolution {
    /// Goes through a generation again. What was evaluated at the end of a run changes
    /// nothing.
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

    /// How the run stood after the latest generation, if that was its last one. `told`: what
    /// was told of that.
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

    /// Goes through a re-evaluation again; none if its blocks are not those of one.
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

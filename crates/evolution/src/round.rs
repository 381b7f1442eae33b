//! The rounds of a run, one batch of evaluations each.

use std::sync::Arc;

use determinism::random::TrialSet;
use experiment_file::ExperimentConfig;

use super::{
    Champion, Digest, End, Evolution, EvolutionError, Generation, GenerationSummary, Judgement,
    Learnt, NextLink, Population, Reevaluation, Told,
};

/// A batch to evaluate, with its purpose: a generation, a re-evaluation of candidates for the
/// champion on held-out trials, or at the end the judgement of the champion and of all elites on
/// trials that select nothing.
#[derive(Debug)]
pub enum Round {
    /// The next generation.
    Generation(Arc<Evolution>, Generation),
    /// Candidates on a block of held-out trials, after a generation that evolution has learnt from.
    Reevaluation(Box<AfterGeneration>, Box<Reevaluation>),
    /// The champion and the elites on trials that select nothing, after the last generation.
    Judgement(Box<Concluded>, Box<Judgement>),
}

/// The step after a round.
#[derive(Debug)]
pub enum Next {
    /// Another round of the same generation.
    Evaluate(Box<Round>),
    /// The generation is complete.
    Commit(Box<Concluded>),
}

/// The state of evolution after it has learnt from a generation.
#[derive(Debug, Clone)]
pub struct AfterGeneration {
    evolution: Evolution,
    told: Told,
    learnt: Learnt,
}

/// A complete generation, with its re-evaluation and its judgement.
#[derive(Debug)]
pub struct Concluded {
    /// The state of evolution after it.
    pub evolution: Arc<Evolution>,
    /// Its entry in the fitness log.
    pub told: Told,
    /// The result of learning from it.
    pub learnt: Learnt,
    /// The present champion.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything so far.
    pub digest: Digest,
    /// The next round, unless evolution is over.
    pub next: Option<Round>,
}

impl Round {
    /// The next generation of an evolution.
    pub fn generation(evolution: impl Into<Arc<Evolution>>) -> Self {
        let evolution = evolution.into();
        let generation = evolution.ask();
        Self::Generation(evolution, generation)
    }

    /// The trials of the round.
    pub fn trial_set(&self) -> TrialSet {
        match self {
            Self::Generation(_, generation) => TrialSet::Generation(generation.index),
            Self::Reevaluation(_, reevaluation) => reevaluation.trial_set(),
            Self::Judgement(_, judgement) => judgement.trial_set(),
        }
    }

    /// The genotypes to evaluate.
    pub fn genotypes(&self) -> Population {
        match self {
            Self::Generation(_, generation) => Arc::clone(&generation.genotypes),
            Self::Reevaluation(_, reevaluation) => reevaluation.genotypes(),
            Self::Judgement(_, judgement) => judgement.genotypes(),
        }
    }

    /// The distribution of the genotypes, if workers can draw from it.
    pub fn distribution(&self) -> Option<Arc<[u8]>> {
        match self {
            Self::Generation(evolution, _) => evolution.distribution().map(Into::into),
            Self::Reevaluation(..) | Self::Judgement(..) => None,
        }
    }

    /// The generation's link of the digest chain.
    pub fn link(&self) -> Option<Arc<NextLink>> {
        match self {
            Self::Generation(_, generation) => Some(generation.link()),
            Self::Reevaluation(..) | Self::Judgement(..) => None,
        }
    }

    /// Descriptors or aims of each trial.
    pub fn n_descriptors(&self) -> usize {
        match self {
            Self::Generation(evolution, _) => evolution.n_descriptors(),
            Self::Reevaluation(..) => 0,
            Self::Judgement(_, judgement) => judgement.values_per_trial() - 1,
        }
    }

    /// Trials of each genotype.
    pub fn n_trials(&self, config: &ExperimentConfig) -> u32 {
        match self {
            Self::Generation(..) => config.algorithm.num_evaluations,
            Self::Reevaluation(..) => config.algorithm.champion_trials,
            Self::Judgement(..) => config.algorithm.judgement_trials,
        }
    }

    /// Concludes the round with its values: for each genotype and trial the fitness, and then the
    /// descriptors.
    ///
    /// # Errors
    ///
    /// If evolution cannot continue.
    pub fn conclude(
        self,
        config: &ExperimentConfig,
        values: &[Vec<f64>],
    ) -> Result<Next, EvolutionError> {
        match self {
            Self::Generation(evolution, generation) => {
                // Usually, the previous generation is stored by now, and nothing is copied.
                let mut evolution = Arc::unwrap_or_clone(evolution);
                let told = Told::from_values(values, evolution.n_descriptors());
                let completion = |summary: &_| completion(config, summary);
                let learnt = evolution.learn(generation, &told, completion)?;
                let after = AfterGeneration { evolution, told, learnt };
                let is_due = after.is_over() || after.is_scheduled(config);
                Ok(match after.evolution.reevaluation().filter(|_| is_due) {
                    Some(reevaluation) => {
                        Self::Reevaluation(Box::new(after), Box::new(reevaluation)).into()
                    }
                    None => Next::Commit(Box::new(after.concluded(None))),
                })
            }
            Self::Reevaluation(mut after, mut reevaluation) => {
                reevaluation.learn(values);
                if !reevaluation.is_over() {
                    return Ok(Self::Reevaluation(after, reevaluation).into());
                }
                let mut with_champion = after.evolution.clone();
                with_champion.set_champion(&reevaluation);
                let blocks = reevaluation.blocks().to_vec();
                if after.is_scheduled(config) {
                    after.evolution = with_champion.clone();
                    after.told.blocks = blocks;
                } else {
                    after.told.end = End { blocks, ..End::default() };
                }
                let judgement = with_champion.judgement().filter(|_| after.is_over());
                let concluded = Box::new(after.concluded(Some(with_champion)));
                Ok(match judgement {
                    Some(judgement) => Self::Judgement(concluded, Box::new(judgement)).into(),
                    None => Next::Commit(concluded),
                })
            }
            Self::Judgement(mut concluded, judgement) => {
                let blocks = std::mem::take(&mut concluded.told.end.blocks);
                concluded.told.end = End { blocks, ..judgement.end(values) };
                let (champion, digest) = judgement.decide(values);
                concluded.champion = Some(champion);
                concluded.digest = digest;
                Ok(Next::Commit(concluded))
            }
        }
    }
}

impl From<Round> for Next {
    fn from(round: Round) -> Self {
        Self::Evaluate(Box::new(round))
    }
}

impl AfterGeneration {
    fn is_over(&self) -> bool {
        self.learnt.completed.is_some()
    }

    fn is_scheduled(&self, config: &ExperimentConfig) -> bool {
        config.algorithm.compares_after(self.evolution.n_generations())
    }

    /// `with_champion`: evolution after a re-evaluation. An extended run does not continue from the
    /// extra re-evaluation at the former end, because its later generations must have the bits of a
    /// run that had all these generations from the beginning.
    fn concluded(self, with_champion: Option<Evolution>) -> Concluded {
        let is_over = self.is_over();
        let Self { evolution, told, learnt } = self;
        let digest = match &with_champion {
            Some(with_champion) => with_champion.champion_digest(),
            None => evolution.digest(),
        };
        let champion = with_champion.as_ref().unwrap_or(&evolution).champion().cloned();
        let evolution = Arc::new(evolution);
        let next = (!is_over).then(|| Round::generation(Arc::clone(&evolution)));
        Concluded { evolution, told, learnt, champion, digest, next }
    }
}

/// Why a run is over after a generation, if it is; empty if all generations are done.
pub fn completion(config: &ExperimentConfig, summary: &GenerationSummary) -> Option<String> {
    let algorithm = &config.algorithm;
    let (n_generations, mean) = (summary.generation + 1, summary.statistics.mean.get());
    if algorithm.target_fitness.is_some_and(|target| mean >= target) {
        return Some(format!("the mean fitness {mean} has reached the target"));
    }
    (n_generations >= algorithm.generations).then(String::new)
}

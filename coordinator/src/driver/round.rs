//! What the fleet is judging for an experiment, and what comes of it: a
//! generation, and from time to time the champion and who challenges it.

use std::sync::Arc;

use experiment_file::ExperimentConfig;
use sim_core::TrialSet;

use crate::{engine::EvaluatedBatch, store::Generation};
use evolution::{Champion, ChampionSource, Evolution, EvolutionError, Population, Reevaluation};

/// What the fleet judges at once.
#[derive(Debug)]
pub enum Round {
    /// The next generation.
    Generation(Arc<Evolution>, evolution::Generation),
    /// Candidates on held-out trials, after a generation that has been learnt
    /// from and is not committed yet.
    Reevaluation(Box<Learnt>, Reevaluation),
}

/// What comes after a round.
pub enum Next {
    /// Another round, before anything is committed.
    Judge(Box<Round>),
    /// The generation is complete.
    Commit(Box<Complete>),
}

/// A generation that has been learnt from.
#[derive(Debug, Clone)]
pub struct Learnt {
    evolution: Evolution,
    generation: Generation,
    notices: Vec<String>,
    /// Why evolution is over, if it is.
    over: Option<String>,
}

/// A generation that can be committed.
pub struct Complete {
    /// For the history.
    pub generation: Generation,
    /// For whoever resumes.
    pub evolution: Arc<Evolution>,
    /// The champion so far.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything so far.
    pub digest: String,
    /// For the log.
    pub notices: Vec<String>,
    /// Why evolution is over, if it is.
    pub over: Option<String>,
    /// The next round, unless evolution is over.
    pub next: Option<Round>,
}

impl Round {
    /// The next generation of an evolution.
    pub fn generation(evolution: impl Into<Arc<Evolution>>) -> Self {
        let evolution = evolution.into();
        let asked = evolution.ask();
        Self::Generation(evolution, asked)
    }

    /// Which worlds and noise its trials meet.
    pub fn trial_set(&self) -> TrialSet {
        match self {
            Self::Generation(_, asked) => TrialSet::Generation(asked.index),
            Self::Reevaluation(_, reevaluation) => TrialSet::HeldOut(reevaluation.generation),
        }
    }

    /// Who is evaluated.
    pub fn genotypes(&self) -> Population {
        match self {
            Self::Generation(_, asked) => Arc::clone(&asked.genotypes),
            Self::Reevaluation(_, Reevaluation { candidates, .. }) => {
                candidates.iter().map(|candidate| candidate.genotype.clone()).collect()
            }
        }
    }

    /// On how many trials.
    pub fn n_trials(&self, config: &ExperimentConfig) -> u32 {
        match self {
            Self::Generation(..) => config.algorithm.num_evaluations,
            Self::Reevaluation(..) => config.algorithm.champion_trials,
        }
    }

    /// Draws the conclusions.
    pub fn conclude(
        self,
        config: &ExperimentConfig,
        evaluated: &EvaluatedBatch,
    ) -> Result<Next, EvolutionError> {
        match self {
            Self::Generation(evolution, asked) => {
                // By now, the generation before is usually stored, and nothing is copied.
                let evolution = Arc::unwrap_or_clone(evolution);
                let learnt = learn(config, evolution, asked, evaluated)?;
                Ok(match learnt.evolution.reevaluation() {
                    Some(candidates) if learnt.over.is_some() || learnt.is_scheduled(config) => {
                        Next::Judge(Box::new(Self::Reevaluation(Box::new(learnt), candidates)))
                    }
                    _ => Next::Commit(Box::new(learnt.complete(None))),
                })
            }
            Self::Reevaluation(mut learnt, candidates) => {
                let mut crowned = learnt.evolution.clone();
                crowned.set_champion(&candidates, &evaluated.values);
                learnt.notices.extend(crowned.champion().map(describe));
                if learnt.is_scheduled(config) {
                    learnt.evolution = crowned.clone();
                }
                Ok(Next::Commit(Box::new(learnt.complete(Some(crowned)))))
            }
        }
    }
}

impl Learnt {
    fn is_scheduled(&self, config: &ExperimentConfig) -> bool {
        self.evolution.n_generations().is_multiple_of(config.algorithm.champion_every)
    }

    /// `crowned`: evolution after a re-evaluation. If that was an extra one, at
    /// the end, it is not what a longer run goes on from: more generations must
    /// give the same bits as if they had been asked for at once.
    fn complete(self, crowned: Option<Evolution>) -> Complete {
        let Self { evolution, generation, notices, over } = self;
        let digest = match &crowned {
            Some(crowned) => crowned.champion_digest(),
            None => evolution.digest(),
        };
        let champion = crowned.as_ref().unwrap_or(&evolution).champion().cloned();
        let evolution = Arc::new(evolution);
        Complete {
            generation,
            champion,
            digest: digest.to_string(),
            notices,
            next: over.is_none().then(|| Round::generation(Arc::clone(&evolution))),
            evolution,
            over,
        }
    }
}

fn learn(
    config: &ExperimentConfig,
    mut evolution: Evolution,
    asked: evolution::Generation,
    evaluated: &EvaluatedBatch,
) -> Result<Learnt, EvolutionError> {
    let record = evolution.tell(asked, &evaluated.values)?;
    let generation = Generation {
        generation: record.generation,
        statistics: record.statistics,
        digest: record.digest.to_string(),
        duration_ms: evaluated.duration.as_millis() as u64,
        episodes: evaluated.values.iter().map(|trials| trials.len() as u64).sum(),
        workers: evaluated.n_workers as u64,
        idle_share: evaluated.idle_share,
    };
    let mut notices = Vec::new();
    if record.n_non_finite > 0 {
        notices.push(format!(
            "generation {}: the fitness of {} individuals is not finite; they rank last",
            record.generation, record.n_non_finite
        ));
    }
    let algorithm = &config.algorithm;
    let mean = record.statistics.mean;
    let over = if algorithm.target_fitness.is_some_and(|target| mean >= target) {
        Some(format!("the mean fitness {mean} has reached the target"))
    } else {
        (evolution.n_generations() >= algorithm.generations).then(String::new)
    };
    Ok(Learnt { evolution, generation, notices, over })
}

/// A champion after its re-evaluation, for the log.
fn describe(champion: &Champion) -> String {
    let held_out = match &champion.held_out {
        Some(held_out) => format!(
            "{:.6} +- {:.6} on {} held-out trials",
            held_out.mean, held_out.ci95, held_out.n_trials
        ),
        None => "without finite fitness on held-out trials".to_owned(),
    };
    let generation = champion.generation;
    match (champion.source, champion.fitness()) {
        (ChampionSource::Individual(individual), Some(fitness)) => format!(
            "champion: {held_out} ({fitness:.6} when chosen), \
             individual {individual} of generation {generation}"
        ),
        _ => {
            format!("champion: {held_out}, mean of the distribution after generation {generation}")
        }
    }
}

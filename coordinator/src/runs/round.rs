//! Rounds, and their conclusions. A round is a generation, a re-evaluation of candidates for the
//! champion on held-out trials, or at the end the judgement of the champion and of all elites on
//! trials that select nothing.

use std::sync::Arc;

use experiment_file::ExperimentConfig;
use sim_core::TrialSet;
use swarm_telemetry::number;

use engine::EvaluatedBatch;

use crate::store::GenerationRecord;
use evolution::{
    Champion, ChampionSource, End, Evolution, EvolutionError, Front, GenerationSummary, Judgement,
    Learnt, NextLink, Population, Reevaluation, Told,
};

/// A batch that the fleet evaluates, with its purpose.
#[derive(Debug)]
pub enum Round {
    /// The next generation.
    Generation(Arc<Evolution>, evolution::Generation),
    /// Candidates on a block of held-out trials, after a generation that evolution has learnt
    /// from and that is not committed yet.
    Reevaluation(Box<UpdatedEvolution>, Box<Reevaluation>),
    /// The champion and the elites of a repertoire on trials that select nothing, after the last
    /// generation, which is not committed yet.
    Judgement(Box<ReadyToCommit>, Box<Judgement>),
}

/// The step after a round.
#[derive(Debug)]
pub enum Next {
    /// Another round, before the commit.
    Evaluate(Box<Round>),
    /// The generation is complete.
    Commit(Box<ReadyToCommit>),
}

/// The state of evolution after it has learnt from a generation.
#[derive(Debug, Clone)]
pub struct UpdatedEvolution {
    evolution: Evolution,
    generation: GenerationRecord,
    /// The fitness that it learnt from.
    told: Told,
    notices: Vec<String>,
    /// Why evolution is over, if it is; empty if all generations are done.
    completed: Option<String>,
}

/// A generation that is ready to commit.
#[derive(Debug)]
pub struct ReadyToCommit {
    /// Its row of the history.
    pub generation: GenerationRecord,
    /// Its entry in the fitness log.
    pub told: Told,
    /// The state of evolution after it.
    pub evolution: Arc<Evolution>,
    /// The present champion.
    pub champion: Option<Champion>,
    /// The last link of the digest chain that covers everything so far, hexadecimal.
    pub digest: String,
    /// Lines for the log and the experiment's events.
    pub notices: Vec<String>,
    /// Why evolution is over, if it is; empty if all generations are done.
    pub completed: Option<String>,
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

    /// The trial set of the round.
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

    /// Descriptors of each trial.
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

    /// Concludes the round with the fitness of its batch. Fails if evolution cannot continue.
    pub fn conclude(
        self,
        config: &ExperimentConfig,
        evaluated: &EvaluatedBatch,
    ) -> Result<Next, EvolutionError> {
        match self {
            Self::Generation(evolution, generation) => {
                // Usually, the previous generation is stored by now, and nothing is copied.
                let evolution = Arc::unwrap_or_clone(evolution);
                let updated = learn(config, evolution, generation, evaluated)?;
                Ok(match updated.evolution.reevaluation() {
                    Some(reevaluation)
                        if updated.completed.is_some() || updated.is_scheduled(config) =>
                    {
                        let round = Self::Reevaluation(Box::new(updated), Box::new(reevaluation));
                        Next::Evaluate(Box::new(round))
                    }
                    _ => Next::Commit(Box::new(updated.into_ready(None))),
                })
            }
            Self::Reevaluation(mut updated, mut reevaluation) => {
                reevaluation.learn(&evaluated.values);
                updated.notices.extend(evaluated.notices.iter().cloned());
                if !reevaluation.is_over() {
                    return Ok(Next::Evaluate(Box::new(Self::Reevaluation(updated, reevaluation))));
                }
                let mut with_champion = updated.evolution.clone();
                with_champion.set_champion(&reevaluation);
                updated.notices.extend(with_champion.champion().map(describe));
                let blocks = reevaluation.blocks().to_vec();
                if updated.is_scheduled(config) {
                    updated.evolution = with_champion.clone();
                    updated.told.blocks = blocks;
                } else {
                    updated.told.end = End { blocks, ..End::default() };
                }
                let is_last = updated.completed.is_some();
                let judgement = with_champion.judgement().filter(|_| is_last);
                let ready = Box::new(updated.into_ready(Some(with_champion)));
                Ok(match judgement {
                    Some(judgement) => {
                        Next::Evaluate(Box::new(Self::Judgement(ready, Box::new(judgement))))
                    }
                    None => Next::Commit(ready),
                })
            }
            Self::Judgement(mut ready, judgement) => {
                let blocks = std::mem::take(&mut ready.told.end.blocks);
                ready.told.end = End { blocks, ..judgement.end(&evaluated.values) };
                let (champion, digest) = judgement.decide(&evaluated.values);
                ready.notices.extend(evaluated.notices.iter().cloned());
                ready.notices.push(describe_judgement(&champion));
                ready.notices.extend(describe_elites(&ready.evolution, &ready.told.end));
                ready.digest = digest.to_string();
                ready.champion = Some(champion);
                Ok(Next::Commit(ready))
            }
        }
    }
}

impl UpdatedEvolution {
    fn is_scheduled(&self, config: &ExperimentConfig) -> bool {
        config.algorithm.compares_after(self.evolution.n_generations())
    }

    /// `with_champion`: evolution after a re-evaluation. An extended run does not continue from the
    /// extra re-evaluation at the former end, because its later generations must have the bits of a
    /// run that had all these generations from the beginning.
    fn into_ready(self, with_champion: Option<Evolution>) -> ReadyToCommit {
        let Self { evolution, generation, told, notices, completed } = self;
        let digest = match &with_champion {
            Some(with_champion) => with_champion.champion_digest(),
            None => evolution.digest(),
        };
        let champion = with_champion.as_ref().unwrap_or(&evolution).champion().cloned();
        let evolution = Arc::new(evolution);
        ReadyToCommit {
            generation,
            told,
            champion,
            digest: digest.to_string(),
            notices,
            next: completed.is_none().then(|| Round::generation(Arc::clone(&evolution))),
            evolution,
            completed,
        }
    }
}

fn learn(
    config: &ExperimentConfig,
    mut evolution: Evolution,
    generation: evolution::Generation,
    evaluated: &EvaluatedBatch,
) -> Result<UpdatedEvolution, EvolutionError> {
    let told = Told::from_values(&evaluated.values, evolution.n_descriptors());
    let learnt = evolution.learn(generation, &told, |summary| completion(config, summary))?;
    let Learnt { summary, notices: remarks, completed } = learnt;
    let generation = GenerationRecord {
        generation: summary.generation,
        statistics: summary.statistics,
        digest: summary.digest.to_string(),
        duration_ms: evaluated.duration.as_millis() as u64,
        episodes: told.trial_fitness.iter().map(|trials| trials.len() as u64).sum(),
        workers: evaluated.n_workers as u64,
        idle_share: evaluated.idle_share,
    };
    let notices = [evaluated.notices.clone(), remarks].concat();
    Ok(UpdatedEvolution { evolution, generation, told, notices, completed })
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

/// Describes a champion after a re-evaluation, for the log.
pub fn describe(champion: &Champion) -> String {
    let held_out = match &champion.held_out {
        Some(held_out) => format!(
            "selected with mean {} on {} held-out trials, optimistic",
            number(held_out.mean.get(), 6),
            held_out.n_trials
        ),
        None => "without finite fitness on held-out trials".to_owned(),
    };
    let generation = champion.generation;
    match champion.source {
        ChampionSource::Individual(individual) => {
            format!("champion: individual {individual} of generation {generation}, {held_out}")
        }
        ChampionSource::Mean => {
            format!("champion: mean of the distribution after generation {generation}, {held_out}")
        }
    }
}

/// Describes a champion's judgement, for the log.
pub fn describe_judgement(champion: &Champion) -> String {
    match &champion.judged {
        Some(judged) => format!(
            "champion judged: {} (95 %: {} to {}) on {} trials that selected nothing",
            number(judged.mean.get(), 6),
            number(judged.low.get(), 6),
            number(judged.high.get(), 6),
            judged.n_trials
        ),
        None => "champion not judged: its fitness is not finite in every trial".to_owned(),
    }
}

/// Describes the repertoire or the front at the end of a run by its corrected figures, for the log;
/// `None` without one.
pub fn describe_elites(evolution: &Evolution, end: &End) -> Option<String> {
    evolution
        .front(end)
        .map_or_else(|| describe_repertoire(evolution, end), |front| Some(describe_front(&front)))
}

fn describe_front(front: &Front<'_>) -> String {
    let n_elites = front.elites.len();
    let figures = front.figures(None).and_then(|figures| Some((figures.stay?, figures)));
    let Some((stay, figures)) = figures else {
        return format!("front: none of {n_elites} elites has finite values in every trial");
    };
    let reference: Vec<String> = figures.reference.iter().map(|value| number(*value, 6)).collect();
    format!(
        "front judged: hypervolume {} up to ({}), and {:.0} % of {n_elites} elites stay on it",
        number(figures.hypervolume, 6),
        reference.join(", "),
        100.0 * stay,
    )
}

fn describe_repertoire(evolution: &Evolution, end: &End) -> Option<String> {
    let repertoire = evolution.elites(end)?;
    let n_elites = repertoire.elites.len();
    let Some(figures) = repertoire.figures() else {
        return Some(format!(
            "repertoire: none of {n_elites} elites has finite values in every trial"
        ));
    };
    Some(format!(
        "repertoire judged: QD score {}, coverage {:.0} %, and {:.0} % of {n_elites} elites stay in \
         their cell",
        number(figures.qd_score, 6),
        100.0 * figures.coverage,
        100.0 * figures.stay,
    ))
}

//! A round of evolution on the fleet, and what people read about it.

use std::sync::Arc;

use experiment_file::ExperimentConfig;
use swarm_telemetry::number;

use engine::{Batch, EvaluatedBatch};
use evolution::{
    Champion, ChampionSource, Concluded, End, Evolution, EvolutionError, Front, NextLink, Told,
};

use crate::store::GenerationRecord;

/// A round that the fleet evaluates, with what the fleet said of the earlier rounds of the same
/// generation.
#[derive(Debug)]
pub struct Round {
    of: evolution::Round,
    figures: Figures,
    notices: Vec<String>,
}

/// The fleet's figures of a generation.
#[derive(Debug, Clone, Copy, Default)]
struct Figures {
    duration_ms: u64,
    n_workers: u64,
    idle_share: f64,
}

/// The step after a round.
#[derive(Debug)]
pub enum Next {
    /// Another round, before the commit.
    Evaluate(Box<Round>),
    /// The generation is complete.
    Commit(Box<ReadyToCommit>),
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

impl From<evolution::Round> for Round {
    fn from(of: evolution::Round) -> Self {
        Self { of, figures: Figures::default(), notices: Vec::new() }
    }
}

impl Round {
    /// The next generation of an evolution.
    pub fn generation(evolution: impl Into<Arc<Evolution>>) -> Self {
        evolution::Round::generation(evolution).into()
    }

    /// The batch to evaluate.
    pub fn batch(&self, config: &ExperimentConfig) -> Batch {
        let (set, n_trials) = (self.of.trial_set(), self.of.n_trials(config));
        let batch = Batch::described(set, self.of.genotypes(), n_trials, self.of.n_descriptors());
        Batch { distribution: self.of.distribution(), ..batch }
    }

    /// The generation's link of the digest chain.
    pub fn link(&self) -> Option<Arc<NextLink>> {
        self.of.link()
    }

    /// Concludes the round with its batch. Fails if evolution cannot continue.
    pub fn conclude(
        self,
        config: &ExperimentConfig,
        evaluated: &EvaluatedBatch,
    ) -> Result<Next, EvolutionError> {
        let Self { of, mut figures, mut notices } = self;
        if matches!(of, evolution::Round::Generation(..)) {
            figures = Figures {
                duration_ms: evaluated.duration.as_millis() as u64,
                n_workers: evaluated.n_workers as u64,
                idle_share: evaluated.idle_share,
            };
        }
        notices.extend(evaluated.notices.iter().cloned());
        Ok(match of.conclude(config, &evaluated.values)? {
            evolution::Next::Evaluate(of) => {
                Next::Evaluate(Box::new(Self { of: *of, figures, notices }))
            }
            evolution::Next::Commit(concluded) => {
                Next::Commit(Box::new(ready_to_commit(*concluded, figures, notices)))
            }
        })
    }
}

fn ready_to_commit(
    concluded: Concluded,
    figures: Figures,
    mut notices: Vec<String>,
) -> ReadyToCommit {
    let Concluded { evolution, told, learnt, champion, digest, next } = concluded;
    let summary = learnt.summary;
    notices.extend(learnt.notices);
    notices.extend(news(&evolution, &told, champion.as_ref()));
    ReadyToCommit {
        generation: GenerationRecord {
            generation: summary.generation,
            statistics: summary.statistics,
            digest: summary.digest.to_string(),
            duration_ms: figures.duration_ms,
            episodes: told.n_episodes(),
            workers: figures.n_workers,
            idle_share: figures.idle_share,
        },
        told,
        evolution,
        champion,
        digest: digest.to_string(),
        notices,
        completed: learnt.completed,
        next: next.map(Round::from),
    }
}

/// What a generation has to say about the champion and, at the end of a run, the elites; for the log.
pub fn news(evolution: &Evolution, told: &Told, champion: Option<&Champion>) -> Vec<String> {
    let mut news = Vec::new();
    if !told.blocks.is_empty() || !told.end.blocks.is_empty() {
        news.extend(champion.map(describe));
    }
    if !told.end.judgement.is_empty() {
        news.extend(champion.map(describe_judgement));
        news.extend(describe_elites(evolution, &told.end));
    }
    news
}

/// Describes a champion after a re-evaluation.
fn describe(champion: &Champion) -> String {
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

/// Describes a champion's judgement.
fn describe_judgement(champion: &Champion) -> String {
    match &champion.judged {
        // A single trial has no interval.
        Some(judged) if judged.n_trials == 1 => format!(
            "champion judged: {} on 1 trial that selected nothing",
            number(judged.mean.get(), 6)
        ),
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

/// Describes the repertoire or the front at the end of a run by its corrected figures; `None` without
/// one.
fn describe_elites(evolution: &Evolution, end: &End) -> Option<String> {
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

//! From a judged generation to the next: learn, store, ask.

use sim_core::config::ExperimentConfig;
use tokio::task;
use tokio_util::sync::CancellationToken;
use tracing::{info, warn};

use crate::{
    clock,
    engine::JudgedGeneration,
    evolution::{Asked, Evolution, EvolutionError, GenerationRecord},
    ids::ExperimentId,
    shared_store::SharedStore,
    store::{Generation, GenerationCommit},
    submission::checkpoint_json,
};

/// A judged generation of an experiment, and what is needed to go on.
pub struct Advance {
    pub store: SharedStore,
    pub shutdown: CancellationToken,
    pub id: ExperimentId,
    pub config: ExperimentConfig,
    pub evolution: Evolution,
    pub asked: Asked,
    pub judged: JudgedGeneration,
}

/// What became of it.
pub struct Advanced {
    pub id: ExperimentId,
    pub outcome: Outcome,
}

/// Where the experiment stands now.
pub enum Outcome {
    /// There is another generation to judge.
    Continues { evolution: Box<Evolution>, asked: Asked },
    /// It has ended, in the store too.
    Ended,
    /// It cannot go on; the store does not know yet.
    Failed(String),
}

impl Advance {
    /// Learns from the generation, commits it, asks for the next.
    pub async fn run(self) -> Advanced {
        let Self { store, shutdown, id, config, evolution, asked, judged } = self;
        let learning = task::spawn_blocking({
            let config = config.clone();
            move || learn(&config, evolution, asked, &judged)
        });
        let learnt = match learning.await.expect("learning does not panic") {
            Ok(learnt) => learnt,
            Err(error) => return Advanced { id, outcome: Outcome::Failed(error.to_string()) },
        };
        let Learnt { evolution, generation, record, notices, completed, next } = learnt;

        let checkpoint = checkpoint_json(&evolution);
        let new_champion = evolution.champion().filter(|_| record.has_new_champion).cloned();
        let stored_generation = generation.clone();
        let stored_notices = notices.clone();
        let reason = completed.clone();
        let committed = store
            .write(&shutdown, move |store| {
                store.commit_generation(
                    id,
                    clock::unix_ms(),
                    &GenerationCommit {
                        generation: &stored_generation,
                        checkpoint: &checkpoint,
                        new_champion: new_champion.as_ref(),
                        notices: &stored_notices,
                        completed: reason.as_deref(),
                    },
                )
            })
            .await;
        if committed {
            log_generation(id, &config, &generation);
            for notice in notices {
                warn!(experiment = %id, "{notice}");
            }
        }
        let outcome = match next {
            Some(asked) if committed => {
                Outcome::Continues { evolution: Box::new(evolution), asked }
            }
            _ => {
                if let Some(reason) = completed.filter(|_| committed) {
                    info!(experiment = %id, digest = %evolution.digest(), reason, "experiment completed");
                }
                Outcome::Ended
            }
        };
        Advanced { id, outcome }
    }
}

/// A generation that has been learnt from, ready to be committed.
struct Learnt {
    evolution: Evolution,
    generation: Generation,
    record: GenerationRecord,
    notices: Vec<String>,
    /// Why evolution is complete, if it is.
    completed: Option<String>,
    /// The next generation, unless evolution is complete.
    next: Option<Asked>,
}

fn learn(
    config: &ExperimentConfig,
    mut evolution: Evolution,
    asked: Asked,
    judged: &JudgedGeneration,
) -> Result<Learnt, EvolutionError> {
    let record = evolution.tell(asked, &judged.trial_fitness)?;
    let generation = Generation {
        generation: record.generation,
        statistics: record.statistics,
        digest: record.digest.to_string(),
        duration_ms: judged.duration.as_millis() as u64,
        episodes: judged.trial_fitness.iter().map(|trials| trials.len() as u64).sum(),
        workers: judged.n_workers as u64,
        idle_share: judged.idle_share,
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
    let completed = if algorithm.target_fitness.is_some_and(|target| mean >= target) {
        Some(format!("the mean fitness {mean} has reached the target"))
    } else if evolution.n_generations() >= algorithm.generations {
        Some(String::new())
    } else {
        None
    };
    let next = completed.is_none().then(|| evolution.ask());
    Ok(Learnt { evolution, generation, record, notices, completed, next })
}

/// The line by which people follow a run.
fn log_generation(id: ExperimentId, config: &ExperimentConfig, generation: &Generation) {
    let seconds = generation.duration_ms.max(1) as f64 / 1000.0;
    let n_done = generation.generation + 1;
    let n_left = config.algorithm.generations.saturating_sub(n_done);
    info!(
        experiment = %id,
        name = config.name,
        generation = generation.generation,
        generations = config.algorithm.generations,
        best = readable(generation.statistics.best),
        mean = readable(generation.statistics.mean),
        min = readable(generation.statistics.min),
        episodes_per_s = (generation.episodes as f64 / seconds).round(),
        workers = generation.workers,
        idle_percent = (generation.idle_share * 1000.0).round() / 10.0,
        eta_s = (n_left as f64 * seconds).round(),
        digest = &generation.digest[..16],
        "generation"
    );
}

/// Six decimals: the store has all of them.
fn readable(fitness: f64) -> f64 {
    (fitness * 1e6).round() / 1e6
}

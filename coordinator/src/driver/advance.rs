//! From a judged round to the next: conclude and store, beside the loop.

use sim_core::config::ExperimentConfig;
use tokio::task;
use tokio_util::sync::CancellationToken;
use tracing::info;

use crate::{
    clock,
    engine::JudgedGeneration,
    ids::ExperimentId,
    shared_store::{SharedStore, Written},
    store::{Generation, GenerationCommit},
};

use super::round::{Complete, Next, Round};

/// A judged round of an experiment, and what is needed to go on.
pub struct Advance {
    pub store: SharedStore,
    pub shutdown: CancellationToken,
    pub id: ExperimentId,
    pub incarnation: u64,
    pub config: ExperimentConfig,
    pub round: Round,
    pub judged: JudgedGeneration,
}

/// What became of it.
pub struct Advanced {
    pub id: ExperimentId,
    pub incarnation: u64,
    pub outcome: Outcome,
}

/// Where the experiment stands now.
pub enum Outcome {
    /// There is another round to judge.
    Continues(Box<Round>),
    /// It has ended, or the coordinator does; the store knows all there is to
    /// know.
    Ended,
    /// It cannot go on; the store does not know yet.
    Failed(String),
}

impl Advance {
    /// Draws the conclusions and commits the generation if it is complete.
    pub async fn run(self) -> Advanced {
        let Self { store, shutdown, id, incarnation, config, round, judged } = self;
        let concluding = task::spawn_blocking(move || (round.conclude(&config, &judged), config));
        let outcome = match concluding.await {
            Ok((Ok(Next::Judge(round)), _)) => Outcome::Continues(round),
            Ok((Ok(Next::Commit(complete)), config)) => {
                commit(&store, &shutdown, id, &config, *complete).await
            }
            Ok((Err(error), _)) => Outcome::Failed(error.to_string()),
            Err(panic) => {
                Outcome::Failed(format!("evolution panicked ({panic}); please report this"))
            }
        };
        Advanced { id, incarnation, outcome }
    }
}

async fn commit(
    store: &SharedStore,
    shutdown: &CancellationToken,
    id: ExperimentId,
    config: &ExperimentConfig,
    complete: Complete,
) -> Outcome {
    let Complete { generation, checkpoint, champion, digest, notices, over, next } = complete;
    let (row, remarks, reason, link) =
        (generation.clone(), notices.clone(), over.clone(), digest.clone());
    let written = store
        .write(shutdown, move |store| {
            store.commit_generation(
                id,
                clock::unix_ms(),
                &GenerationCommit {
                    generation: &row,
                    checkpoint: &checkpoint,
                    champion: champion.as_ref(),
                    digest: &link,
                    notices: &remarks,
                    completed: reason.as_deref(),
                },
            )
        })
        .await;
    match written {
        Written::Yes => {}
        Written::NotWanted => return Outcome::Ended,
        Written::Never(error) => return Outcome::Failed(error.to_string()),
    }
    log_generation(id, config, &generation);
    for notice in notices {
        info!(experiment = %id, "{notice}");
    }
    if let Some(reason) = over {
        info!(experiment = %id, digest, reason, "experiment completed");
    }
    next.map_or(Outcome::Ended, |round| Outcome::Continues(Box::new(round)))
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

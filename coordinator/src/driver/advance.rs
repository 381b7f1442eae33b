//! From a judged round to the next, beside the loop: conclusions are drawn, and a
//! generation that is complete is stored while the next one is judged.

use std::sync::Arc;

use experiment_file::ExperimentConfig;
use swarm_telemetry::Histogram;
use tokio::task;
use tokio_util::sync::CancellationToken;
use tracing::info;

use crate::{
    clock,
    engine::EvaluatedBatch,
    failpoint,
    ids::ExperimentId,
    shared_store::{Retry, SharedStore, Written},
    store::{Generation, GenerationCommit},
    submission::checkpoint_json,
};

use super::round::{Complete, Next, Round};

/// Which run of which experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunId {
    pub id: ExperimentId,
    pub incarnation: u64,
}

/// A step that an experiment has made.
pub struct Advanced {
    pub run: RunId,
    pub step: Step,
}

/// Where it stands now.
pub enum Step {
    /// Conclusions are drawn.
    Concluded(Next),
    /// The latest complete generation is on disk.
    Stored(Generation),
    /// It has ended, or the coordinator does; the store knows all there is to
    /// know.
    Ended,
    /// No conclusion can be drawn.
    Failed(String),
    /// The latest complete generation cannot be stored.
    NotStored(String),
}

/// Draws the conclusions.
pub async fn conclude(
    run: RunId,
    config: Arc<ExperimentConfig>,
    round: Round,
    evaluated: EvaluatedBatch,
) -> Advanced {
    let concluding = task::spawn_blocking(move || round.conclude(&config, &evaluated));
    let step = match concluding.await {
        Ok(Ok(next)) => Step::Concluded(next),
        Ok(Err(error)) => Step::Failed(error.to_string()),
        Err(panic) => Step::Failed(format!("evolution panicked ({panic}); please report this")),
    };
    Advanced { run, step }
}

/// Commits a generation; `duration`: how long that takes, s.
pub async fn commit(
    run: RunId,
    config: Arc<ExperimentConfig>,
    store: SharedStore,
    shutdown: CancellationToken,
    duration: Histogram,
    complete: Complete,
) -> Advanced {
    let Complete { generation, evolution, champion, digest, notices, over, next: _ } = complete;
    let id = run.id;
    let started = clock::now();
    let (row, remarks, reason, link) =
        (generation.clone(), notices.clone(), over.clone(), digest.clone());
    let what = format!("generation {} of experiment {id}", generation.generation);
    let checkpoint = task::spawn_blocking(move || checkpoint_json(&evolution))
        .await
        .expect("numbers and lists serialise");
    failpoint::reached("before commit");
    let written = store
        .write(&shutdown, &what, Retry::WhileUnavailable, move |store| {
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
        Written::Yes => {
            failpoint::reached("committed");
            duration.observe((clock::now() - started).as_secs_f64());
        }
        Written::NotWanted => return Advanced { run, step: Step::Ended },
        Written::Never(error) => return Advanced { run, step: Step::NotStored(error.to_string()) },
    }
    log_generation(id, &config, &generation);
    for notice in notices {
        info!(experiment = %id, "{notice}");
    }
    let Some(reason) = over else { return Advanced { run, step: Step::Stored(generation) } };
    info!(experiment = %id, digest, reason, "experiment completed");
    Advanced { run, step: Step::Ended }
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

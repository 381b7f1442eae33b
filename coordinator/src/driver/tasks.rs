//! Slow tasks that run beside the loop: evolution's arithmetic, and reading and writing the
//! database.

use std::{sync::Arc, time::Duration};

use experiment_file::ExperimentConfig;
use model::restored::restore_evolution;
use swarm_telemetry::Histogram;
use tokio::task;
use tokio_util::sync::CancellationToken;
use tracing::{error, info};

use engine::EvaluatedBatch;

use crate::{
    clock, failpoint,
    ids::ExperimentId,
    runs::{Change, CommitOutcome, Next, ReadyToCommit, Round, RunId},
    shared_store::{Retry, SharedStore, Written},
    store::{Entry, GenerationCommit, GenerationRecord, QuarantinedWorker, Store, StoreError},
};

/// Pause before another attempt to read a checkpoint.
const READ_RETRY_DELAY: Duration = Duration::from_secs(5);

/// The outcome of a task.
pub enum Done {
    /// A run was loaded, or loading failed.
    Loaded(RunId, Result<Round, String>),
    /// A round was concluded, or concluding failed.
    Concluded(RunId, Result<Next, String>),
    /// A commit has ended.
    Committed(RunId, CommitOutcome),
    /// A change of the quarantine was stored.
    QuarantineWritten,
    /// The coordinator stops before the change was stored.
    QuarantineNotWritten,
    /// The write of a change has ended; the flag says whether the change was stored.
    ChangeWritten(ExperimentId, bool),
}

/// The store, and the values that its tasks share.
#[derive(Clone)]
pub struct Disk {
    /// The store.
    pub store: SharedStore,
    /// Ends repeated attempts to write.
    pub shutdown: CancellationToken,
    /// Durations of commits, s.
    pub commit_duration: Histogram,
}

/// Reads a run's evolution from the store and draws its next generation.
pub async fn load(run: RunId, disk: Disk) -> Done {
    let id = run.experiment;
    let what = format!("experiment {id}");
    let stored = loop {
        match disk.store.read(move |store| store.resumable(id)).await {
            Err(error @ StoreError::Unavailable(_)) => {
                let delay = READ_RETRY_DELAY;
                error!("{what} waits: {error}; trying again in {} s", delay.as_secs());
                tokio::select! {
                    () = tokio::time::sleep(delay) => {}
                    () = disk.shutdown.cancelled() => {
                        return Done::Loaded(run, Err("the coordinator stops".to_owned()));
                    }
                }
            }
            other => break other,
        }
    };
    let loading = task::spawn_blocking(move || {
        let (experiment, checkpoint) = stored.map_err(|error| error.to_string())?;
        restore_evolution(&experiment, &checkpoint).map(Round::generation)
    });
    let loaded = match loading.await {
        Ok(loaded) => loaded,
        Err(panic) => Err(format!("evolution panicked ({panic}); please report this")),
    };
    if let Err(reason) = &loaded {
        error!(experiment = %id, reason, "experiment paused");
    }
    Done::Loaded(run, loaded)
}

/// Concludes a round with its evaluated batch.
pub async fn conclude(
    run: RunId,
    config: Arc<ExperimentConfig>,
    round: Round,
    evaluated: EvaluatedBatch,
) -> Done {
    let concluding = task::spawn_blocking(move || round.conclude(&config, &evaluated));
    let conclusion = match concluding.await {
        Ok(conclusion) => conclusion.map_err(|error| error.to_string()),
        Err(panic) => Err(format!("evolution panicked ({panic}); please report this")),
    };
    Done::Concluded(run, conclusion)
}

/// Commits a generation.
pub async fn commit(
    run: RunId,
    config: Arc<ExperimentConfig>,
    ready: ReadyToCommit,
    disk: Disk,
) -> Done {
    let ReadyToCommit { generation, told, evolution, champion, digest, notices, completed, .. } =
        ready;
    let id = run.experiment;
    let started = clock::now();
    let (row, remarks, reason, link) =
        (generation.clone(), notices.clone(), completed.clone(), digest.clone());
    let what = format!("generation {} of experiment {id}", generation.generation);
    let (told, keyframe) = task::spawn_blocking(move || {
        let told = told.to_bytes();
        let is_due = evolution.is_keyframe_due(told.len());
        (told, is_due.then(|| evolution.keyframe()))
    })
    .await
    .expect("numbers and lists serialise");
    failpoint::reached("before commit");
    let written = disk
        .store
        .write(&disk.shutdown, &what, Retry::WhileUnavailable, move |store| {
            store.commit_generation(
                id,
                clock::unix_ms(),
                &GenerationCommit {
                    generation: &row,
                    entry: Entry { told: &told, keyframe: keyframe.as_deref() },
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
            disk.commit_duration.observe((clock::now() - started).as_secs_f64());
        }
        Written::NotWanted => return Done::Committed(run, CommitOutcome::NotWanted),
        Written::Never(error) => {
            return Done::Committed(run, CommitOutcome::Failed(error.to_string()));
        }
    }
    log_generation(id, &config, &generation);
    for notice in notices {
        info!(experiment = %id, "{notice}");
    }
    if let Some(reason) = completed {
        info!(experiment = %id, digest, reason, "experiment completed");
    }
    Done::Committed(run, CommitOutcome::Stored)
}

/// Writes a change.
pub async fn write_change(id: ExperimentId, change: Change, disk: Disk) -> Done {
    let now_ms = clock::unix_ms();
    failpoint::reached("before change");
    let what = format!("the {} of experiment {id}", change.name());
    // If the coordinator stops before the write, the experiment is unchanged after a restart, and
    // clients can change it again.
    let written = disk
        .store
        .write(&disk.shutdown, &what, Retry::Always, move |store| change.write(store, id, now_ms))
        .await;
    let is_stored = matches!(written, Written::Yes);
    if is_stored {
        failpoint::reached("changed");
    }
    Done::ChangeWritten(id, is_stored)
}

/// A change of the quarantine.
#[derive(Debug, Clone)]
pub enum QuarantineWrite {
    /// Adds a worker.
    Add(QuarantinedWorker),
    /// Removes the worker of this name.
    Remove(String),
}

/// Stores a change of the quarantine.
pub async fn write_quarantine(change: QuarantineWrite, disk: Disk) -> Done {
    let now_ms = clock::unix_ms();
    let what = match &change {
        QuarantineWrite::Add(worker) => format!("the quarantine of worker \"{}\"", worker.name),
        QuarantineWrite::Remove(name) => format!("the readmission of worker \"{name}\""),
    };
    let write = move |store: &mut Store| match &change {
        QuarantineWrite::Add(worker) => store.quarantine(worker, now_ms),
        QuarantineWrite::Remove(name) => store.readmit(name),
    };
    // If the coordinator stops before the write, a later fault reveals the faulty worker again, and
    // a client gets no confirmation of a readmission.
    match disk.store.write(&disk.shutdown, &what, Retry::Always, write).await {
        Written::Yes => Done::QuarantineWritten,
        Written::NotWanted | Written::Never(_) => Done::QuarantineNotWritten,
    }
}

/// The line by which people follow a run.
fn log_generation(id: ExperimentId, config: &ExperimentConfig, generation: &GenerationRecord) {
    let seconds = generation.duration_ms.max(1) as f64 / 1000.0;
    let n_done = generation.generation + 1;
    let n_left = config.algorithm.generations.saturating_sub(n_done);
    info!(
        experiment = %id,
        name = config.name,
        generation = generation.generation,
        generations = config.algorithm.generations,
        best = readable(generation.statistics.best.get()),
        mean = readable(generation.statistics.mean.get()),
        min = readable(generation.statistics.min.get()),
        episodes_per_s = (generation.episodes as f64 / seconds).round(),
        workers = generation.workers,
        idle_percent = (generation.idle_share * 1000.0).round() / 10.0,
        eta_s = (n_left as f64 * seconds).round(),
        digest = &generation.digest[..16],
        "generation"
    );
}

/// Rounds to six decimals; the store has all bits.
fn readable(fitness: f64) -> f64 {
    (fitness * 1e6).round() / 1e6
}

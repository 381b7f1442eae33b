//! Continues an ended experiment from its last stored generation.

use evolution::ALGORITHMS;
use experiment_file::ExperimentConfig;
use tracing::info;

use crate::{
    clock,
    driver::DriverEvent,
    ids::ExperimentId,
    queries,
    runs::{Request, Runnable},
    store::{ExperimentRecord, ExperimentState, Store, StoreError, StoredExperiment},
};

use super::{Control, ControlError, capacity};

/// Why an ended experiment continues.
#[derive(Debug, Clone, Copy)]
pub enum Reopening {
    /// A client extends a completed experiment to this total number of generations.
    Extend(u64),
    /// A client retries a failed experiment, because the cause is gone.
    Retry,
    /// A client resumes a failed or cancelled experiment.
    Resume,
}

impl Control {
    /// Continues an ended experiment, to the bits of one that never ended.
    pub async fn reopen(
        &self,
        id: ExperimentId,
        reopening: Reopening,
    ) -> Result<ExperimentRecord, ControlError> {
        self.find(id).await?;
        // Wait until the experiment's end is stored.
        self.request(id, Request::Settle).await?;
        let control = self.clone();
        // In a task of its own: the driver must hear of a stored change even if the client goes
        // away meanwhile.
        let reopening = tokio::spawn(async move { control.run_again(id, reopening).await });
        reopening.await.map_err(|_| ControlError::Panicked("continuing the experiment"))??;
        self.find(id).await
    }

    /// Stores that an ended experiment continues, and hands it to the driver.
    async fn run_again(&self, id: ExperimentId, reopening: Reopening) -> Result<(), ControlError> {
        let control = self.clone();
        let prepared = self.check_and_write(move |store| {
            let runnable = prepare(store, id, reopening, control.memory_budget)?;
            // Within the operation: whoever reads that it runs must not take it up as well.
            if runnable.is_some() {
                control.forget_waiting(id);
            }
            Ok(runnable)
        });
        let Some(runnable) = prepared.await? else { return Ok(()) };
        info!(experiment = %id, name = runnable.config.name, "experiment goes on");
        let ready = DriverEvent::ExperimentReady(Box::new(runnable));
        self.events.send(ready).await.map_err(|_| ControlError::ShuttingDown)
    }
}

/// Checks that an experiment can continue, and stores that it does. `None` if another client has
/// resumed it already.
fn prepare(
    store: &mut Store,
    id: ExperimentId,
    reopening: Reopening,
    memory_budget: u64,
) -> Result<Option<Runnable>, ControlError> {
    let experiment = queries::experiment(store, id)?;
    let Some(config_json) = config_of(&experiment, reopening)? else { return Ok(None) };
    if let Some(incompatible) = queries::incompatibility(&experiment) {
        return Err(ControlError::NotNow(format!(
            "experiment {id} cannot continue: {incompatible}"
        )));
    }
    // More generations need no more memory.
    capacity::check_room(store, &experiment.summary, experiment.genotype_len, memory_budget)?;
    let runnable = runnable(store, id, &config_json)?;
    let why = match reopening {
        Reopening::Extend(generations) => format!("extended to {generations} generations"),
        Reopening::Retry => "retried".to_owned(),
        Reopening::Resume => "resumed".to_owned(),
    };
    store.reopen(id, experiment.state, &config_json, &why, clock::unix_ms())?;
    Ok(Some(runnable))
}

/// The configuration with which an experiment continues, or why it cannot. `None` if another
/// client has resumed it since this one found it ended.
fn config_of(
    experiment: &StoredExperiment,
    reopening: Reopening,
) -> Result<Option<String>, ControlError> {
    use ExperimentState::{Cancelled, Completed, Failed, Paused, Running};
    let (ExperimentRecord { id, state, .. }, config_json) =
        (&experiment.record, &experiment.config_json);
    let not_now = |what: String| Err(ControlError::NotNow(format!("experiment {id} {what}")));
    match (reopening, state) {
        (Reopening::Retry, Failed) | (Reopening::Resume, Cancelled | Failed) => {
            Ok(Some(config_json.clone()))
        }
        (Reopening::Extend(generations), Completed) if experiment.can_be_continued() => {
            longer(experiment, generations).map(Some)
        }
        (Reopening::Extend(_), Completed) => not_now(format!(
            "has completed before its last generation: {}; continue from there with another \
             target: swarmctl fork {id}@{} --set algorithm.target_fitness=F",
            experiment.reason,
            experiment.n_generations().saturating_sub(1)
        )),
        (Reopening::Extend(_), Running | Paused) => {
            not_now(format!("has not ended; wait until it has completed: swarmctl watch {id}"))
        }
        (Reopening::Retry, Running) => not_now("is running already".to_owned()),
        (_, Paused) => not_now(format!("is paused; continue it with: swarmctl resume {id}")),
        (_, Failed) => not_now(format!("has failed; continue it with: swarmctl resume {id}")),
        (_, Cancelled) => not_now(format!("was cancelled; continue it with: swarmctl resume {id}")),
        (_, Completed) => not_now(format!(
            "has completed; continue it with: swarmctl resume {id} --generations N"
        )),
        (Reopening::Resume, Running) => Ok(None),
    }
}

/// The configuration of a completed experiment with more generations.
fn longer(experiment: &StoredExperiment, generations: u64) -> Result<String, ControlError> {
    let n_done = experiment.n_generations();
    if generations <= n_done {
        let message = format!(
            "experiment {} has {n_done} generations already; ask for more than that in all",
            experiment.id
        );
        return Err(ControlError::Invalid(message));
    }
    let (mut config, _) = ExperimentConfig::from_json(&experiment.config_json, "", ALGORITHMS)?;
    config.algorithm.generations = generations;
    let config_json = config.to_canonical_json();
    // The limits of an experiment file apply here, too.
    ExperimentConfig::from_json(&config_json, "", ALGORITHMS)?;
    Ok(config_json)
}

/// An ended experiment, with the configuration with which it continues.
pub fn runnable(
    store: &Store,
    id: ExperimentId,
    config_json: &str,
) -> Result<Runnable, StoreError> {
    let (experiment, checkpoint) = store.resumable(id)?;
    let experiment = StoredExperiment { config_json: config_json.to_owned(), ..experiment };
    Runnable::restore(&experiment, &checkpoint).map_err(|what| store.unsound(id, what))
}

//! Goes on with what is unfinished when the coordinator starts.

use tracing::warn;

use crate::{
    driver::DriverEvent,
    runs::Runnable,
    store::{ExperimentRecord, Store, StoreError},
};

use super::Control;

impl Control {
    /// Hands every unfinished experiment that this program can compute to the driver.
    pub async fn run_unfinished(&self) -> Result<(), StoreError> {
        for (experiment, checkpoint) in self.store.read(unfinished).await? {
            let id = experiment.id;
            if experiment.fingerprint != sim_core::FINGERPRINT {
                warn!(
                    experiment = %id,
                    "experiment waits: it was started with \"{}\", this is \"{}\"; \
                     finish it with that release, or cancel it and submit it again",
                    experiment.fingerprint,
                    sim_core::FINGERPRINT
                );
                continue;
            }
            let checkpoint =
                checkpoint.ok_or_else(|| StoreError::Corrupt(format!("no checkpoint of {id}")))?;
            let runnable =
                tokio::task::spawn_blocking(move || Runnable::restore(&experiment, &checkpoint))
                    .await
                    .map_err(|_| {
                        StoreError::Corrupt(format!("restoring experiment {id} panicked"))
                    })??;
            // The driver runs for as long as the coordinator does.
            let _ = self.events.send(DriverEvent::ExperimentReady(Box::new(runnable))).await;
        }
        Ok(())
    }
}

/// All unfinished experiments and their checkpoints.
fn unfinished(store: &Store) -> Result<Vec<(ExperimentRecord, Option<String>)>, StoreError> {
    let mut experiments = store.experiments()?;
    experiments.retain(|experiment| experiment.state.is_unfinished());
    let with_checkpoint = |experiment: ExperimentRecord| {
        let checkpoint = store.checkpoint(experiment.id)?;
        Ok((experiment, checkpoint))
    };
    experiments.into_iter().map(with_checkpoint).collect()
}

//! Continues unfinished experiments when the coordinator starts.

use std::{
    collections::BTreeSet,
    sync::{Mutex, MutexGuard, PoisonError},
};

use tracing::{error, warn};

use crate::{
    clock,
    driver::DriverEvent,
    ids::ExperimentId,
    runs::Runnable,
    store::{ExperimentRecord, ExperimentState, Filter, StoreError},
};

use super::{Control, ControlError};

impl Control {
    /// Hands every unfinished experiment that this program can compute to the driver. Paused ones
    /// come last, because memory may not suffice for all. It pauses damaged experiments and
    /// continues the others.
    pub async fn run_unfinished(&self) -> Result<(), StoreError> {
        let unfinished = Filter::unfinished();
        let mut experiments = self.store.read(move |store| store.experiments(&unfinished)).await?;
        experiments.sort_by_key(|experiment| experiment.state == ExperimentState::Paused);
        for ExperimentRecord { id, .. } in experiments {
            match self.restore(id).await {
                Ok(Some(runnable)) => self.start(runnable).await,
                Ok(None) => {}
                Err(unsound @ StoreError::Unsound { .. }) => self.set_aside(id, &unsound).await?,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Starts no unfinished experiment: [`Self::take_up_if_left`] starts one when a client requests
    /// it.
    pub async fn leave_unfinished(&self) -> Result<(), StoreError> {
        let unfinished = Filter::unfinished();
        let unfinished = self.store.read(move |store| store.experiments(&unfinished)).await?;
        lock(&self.left_alone).extend(unfinished.into_iter().map(|experiment| experiment.id));
        Ok(())
    }

    /// Hands an experiment that was left alone to the driver; pauses a damaged one.
    pub async fn take_up_if_left(&self, id: ExperimentId) -> Result<(), ControlError> {
        match self.take_up_from(&self.left_alone, id).await {
            Err(unsound @ StoreError::Unsound { .. }) => Ok(self.set_aside(id, &unsound).await?),
            other => Ok(other?),
        }
    }

    /// Hands an experiment that was set aside to the driver, if the damage is gone.
    pub async fn take_up(&self, id: ExperimentId) -> Result<(), ControlError> {
        Ok(self.take_up_from(&self.set_aside, id).await?)
    }

    /// Hands an experiment that waits to the driver. It waits on if it cannot be restored, or if
    /// the client goes away before.
    async fn take_up_from(
        &self,
        waiting: &Mutex<BTreeSet<ExperimentId>>,
        id: ExperimentId,
    ) -> Result<(), StoreError> {
        if !lock(waiting).contains(&id) {
            return Ok(());
        }
        let restored = self.restore(id).await?;
        // Of two concurrent requests, one starts it.
        let is_first = lock(waiting).remove(&id);
        if let (true, Some(runnable)) = (is_first, restored) {
            self.start(runnable).await;
        }
        Ok(())
    }

    /// An experiment no longer waits to be taken up.
    pub(super) fn forget_waiting(&self, id: ExperimentId) {
        for waiting in [&self.left_alone, &self.set_aside] {
            lock(waiting).remove(&id);
        }
    }

    async fn start(&self, runnable: Runnable) {
        let events = self.events.clone();
        // In a task of its own: an experiment that no longer waits must start even if the client
        // goes away meanwhile.
        let starting = tokio::spawn(async move {
            // The driver runs for as long as the coordinator does.
            let _ = events.send(DriverEvent::ExperimentReady(Box::new(runnable))).await;
        });
        let _ = starting.await;
    }

    /// The stored experiment; none if it has ended, or needs another version of this program.
    async fn restore(&self, id: ExperimentId) -> Result<Option<Runnable>, StoreError> {
        let (experiment, checkpoint) = self.store.read(move |store| store.resumable(id)).await?;
        if !experiment.state.is_unfinished() {
            return Ok(None);
        }
        if experiment.fingerprint != sim_core::FINGERPRINT {
            warn!(
                experiment = %id,
                "experiment waits: it was started with \"{}\", this is \"{}\"; \
                 finish it with that release, or cancel it and submit it again",
                experiment.fingerprint,
                sim_core::FINGERPRINT
            );
            return Ok(None);
        }
        let restoring =
            tokio::task::spawn_blocking(move || Runnable::restore(&experiment, &checkpoint));
        match restoring.await.unwrap_or_else(|_| Err("restoring it panicked".to_owned())) {
            Ok(runnable) => Ok(Some(runnable)),
            Err(what) => Err(self.store.read(move |store| store.unsound(id, what)).await),
        }
    }

    /// Pauses a damaged experiment.
    async fn set_aside(&self, id: ExperimentId, unsound: &StoreError) -> Result<(), StoreError> {
        let reason = unsound.to_string();
        error!(experiment = %id, reason, "experiment paused");
        let now_ms = clock::unix_ms();
        self.store.try_write(move |store| store.set_aside(id, now_ms, &reason)).await?;
        // Only now, so that one that was left alone waits on after a failed write.
        lock(&self.left_alone).remove(&id);
        lock(&self.set_aside).insert(id);
        Ok(())
    }
}

fn lock(ids: &Mutex<BTreeSet<ExperimentId>>) -> MutexGuard<'_, BTreeSet<ExperimentId>> {
    ids.lock().unwrap_or_else(PoisonError::into_inner)
}

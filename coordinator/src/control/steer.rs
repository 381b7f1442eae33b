//! Steers an experiment: cancel, pause, resume, change its priority, prune.

use evolution::Evolution;
use tokio::{sync::oneshot, task, time::timeout};

use crate::{
    clock,
    driver::DriverEvent,
    ids::ExperimentId,
    limits::{CHANGE_TIMEOUT, TEXT_LEN_MAX},
    queries::QueryError,
    runs::Request,
    store::{ExperimentRecord, ExperimentState, Store, StoreError},
    text::printable,
};

use super::{Control, ControlError, reopen::Reopening};

/// The reason of a pause for which the client gave none.
const PAUSED: &str = "paused by a client";

impl Control {
    /// Ends an experiment; does nothing if it has ended.
    pub async fn cancel(&self, id: ExperimentId) -> Result<ExperimentRecord, ControlError> {
        let experiment = self.find(id).await?;
        if !experiment.state.is_unfinished() {
            return Ok(experiment);
        }
        self.request(id, Request::Cancel).await
    }

    /// Pauses an experiment until a client resumes it. `reason`: shown to people; may be empty.
    pub async fn pause(
        &self,
        id: ExperimentId,
        reason: &str,
    ) -> Result<ExperimentRecord, ControlError> {
        if reason.len() > TEXT_LEN_MAX {
            let message = format!("reason is longer than {TEXT_LEN_MAX} bytes");
            return Err(ControlError::Invalid(message));
        }
        let reason = match printable(reason) {
            // A pause without a reason keeps the reason of the previous pause.
            empty if empty.is_empty() => {
                let experiment = self.find(id).await?;
                if experiment.state == ExperimentState::Paused {
                    return Ok(experiment);
                }
                PAUSED.to_owned()
            }
            reason => format!("{PAUSED}: {reason}"),
        };
        self.change(id, Request::Pause(reason)).await
    }

    /// Resumes an experiment that is paused, failed or cancelled, unless it is damaged.
    pub async fn resume(&self, id: ExperimentId) -> Result<ExperimentRecord, ControlError> {
        if !self.find(id).await?.state.is_unfinished() {
            return self.reopen(id, Reopening::Resume).await;
        }
        self.take_up_if_left(id).await?;
        self.take_up(id).await?;
        self.change(id, Request::Resume).await
    }

    /// Deletes the fitness log of an experiment that has ended. Also returns the number of freed
    /// bytes.
    pub async fn prune(&self, id: ExperimentId) -> Result<(ExperimentRecord, u64), ControlError> {
        let experiment = self.find(id).await?;
        if experiment.state.is_unfinished() {
            return Err(StoreError::Unfinished(id).into());
        }
        let none = (experiment.n_generations(), None);
        let (n_generations, keyframe) = match self.keyframe(id).await {
            Ok((n_generations, keyframe)) => (n_generations, Some(keyframe)),
            Err(ControlError::Query(QueryError::Store(StoreError::NoCheckpoint(_)))) => none,
            // Older versions stored no state from which an experiment that ended early could
            // continue.
            Err(ControlError::Query(QueryError::Store(StoreError::Unsound { .. })))
                if !experiment.can_be_continued() =>
            {
                none
            }
            Err(error) => return Err(error),
        };
        let now_ms = clock::unix_ms();
        // The driver no longer knows the experiment, unless another client has reopened it
        // meanwhile, which the store notices.
        let prune =
            move |store: &mut Store| store.prune(id, n_generations, keyframe.as_deref(), now_ms);
        let n_bytes = self.store.try_write(prune).await?;
        Ok((self.find(id).await?, n_bytes))
    }

    /// The number of generations, and the state of evolution after them.
    async fn keyframe(&self, id: ExperimentId) -> Result<(u64, Vec<u8>), ControlError> {
        let (experiment, checkpoint) = self.store.read(move |store| store.resumable(id)).await?;
        let restoring = task::spawn_blocking(move || Evolution::restore(&checkpoint));
        let restored = restoring.await.map_err(|_| ControlError::Panicked("evolution"))?;
        let evolution = restored.map_err(|error| {
            StoreError::Corrupt(format!("the checkpoint of experiment {id}: {error}"))
        })?;
        Ok((experiment.n_generations(), evolution.keyframe()))
    }

    /// Has the driver change an experiment that has not ended, and returns the changed
    /// experiment.
    pub async fn change(
        &self,
        id: ExperimentId,
        request: Request,
    ) -> Result<ExperimentRecord, ControlError> {
        if !self.find(id).await?.state.is_unfinished() {
            return Err(StoreError::Ended(id).into());
        }
        let experiment = self.request(id, request).await?;
        if !experiment.state.is_unfinished() {
            return Err(StoreError::Ended(id).into());
        }
        Ok(experiment)
    }

    /// Has the driver change an experiment, and returns the changed experiment.
    pub(super) async fn request(
        &self,
        id: ExperimentId,
        request: Request,
    ) -> Result<ExperimentRecord, ControlError> {
        let (reply, stored) = oneshot::channel();
        let event = DriverEvent::Requested { experiment: id, request, reply };
        self.events.send(event).await.map_err(|_| ControlError::ShuttingDown)?;
        let stored =
            timeout(CHANGE_TIMEOUT, stored).await.map_err(|_| ControlError::NotStoredYet(id))?;
        let experiment = self.find(id).await?;
        // Not stored: the experiment has ended otherwise meanwhile, or the coordinator is
        // stopping.
        if stored.is_err() && experiment.state.is_unfinished() {
            return Err(ControlError::ShuttingDown);
        }
        Ok(experiment)
    }
}

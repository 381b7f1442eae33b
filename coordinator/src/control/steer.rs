//! Steers an experiment: cancel, pause, resume, another priority.

use tokio::{sync::oneshot, time::timeout};

use crate::{
    driver::DriverEvent,
    ids::ExperimentId,
    limits::{CHANGE_TIMEOUT, TEXT_LEN_MAX},
    priority::Priority,
    runs::Request,
    store::{ExperimentRecord, StoreError},
    text::printable,
};

use super::{Control, ControlError};

/// Why an experiment is paused that a client paused.
const PAUSED: &str = "paused by a client";

impl Control {
    /// Ends an experiment; one that has ended stays as it is.
    pub async fn cancel(&self, id: ExperimentId) -> Result<ExperimentRecord, ControlError> {
        let experiment = self.find(id).await?;
        if !experiment.state.is_unfinished() {
            return Ok(experiment);
        }
        self.request(id, Request::Cancel).await
    }

    /// Has an experiment wait until it is resumed. `reason`: for others; may be empty.
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
            empty if empty.is_empty() => PAUSED.to_owned(),
            reason => format!("{PAUSED}: {reason}"),
        };
        self.change(id, Request::Pause(reason)).await
    }

    /// Lets a paused experiment go on, unless it is damaged.
    pub async fn resume(&self, id: ExperimentId) -> Result<ExperimentRecord, ControlError> {
        self.take_up(id).await?;
        self.change(id, Request::Resume).await
    }

    /// Changes an experiment's share of the fleet.
    pub async fn set_priority(
        &self,
        id: ExperimentId,
        priority: Priority,
    ) -> Result<ExperimentRecord, ControlError> {
        self.change(id, Request::SetPriority(priority)).await
    }

    /// Has the driver change an experiment that has not ended, and reads it again.
    async fn change(
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

    /// Has the driver change an experiment, and reads it again.
    async fn request(
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
        // Not stored: it has ended in another way meanwhile, or the coordinator is
        // about to.
        if stored.is_err() && experiment.state.is_unfinished() {
            return Err(ControlError::ShuttingDown);
        }
        Ok(experiment)
    }
}

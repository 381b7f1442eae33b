//! Submits an experiment: checks it, stores it, has it run.

use tracing::info;

use crate::{
    driver::{DriverEvent, EventSender},
    failpoint,
    ids::ExperimentId,
    limits::KEY_LEN_MAX,
    store::ExperimentRecord,
    submission::{CheckedSubmission, Submission},
};

use super::{
    Control, ControlError,
    placement::{Placement, place},
};

/// A submission that was accepted.
#[derive(Debug)]
pub struct Submitted {
    /// The experiment that it has led to.
    pub experiment: ExperimentRecord,
    /// Keys of the file without effect, and parameters that keep their defaults; one
    /// line each.
    pub warnings: Vec<String>,
}

impl Control {
    /// Submits an experiment. `resume_unfinished`: whether to go on with one of the
    /// same bits, if there is one.
    pub async fn submit(
        &self,
        submission: Submission,
        resume_unfinished: bool,
    ) -> Result<Submitted, ControlError> {
        let request_id = submission.request_id.as_deref().unwrap_or_default();
        for (key, value) in [("request_id", request_id), ("default_name", &submission.default_name)]
        {
            if value.len() > KEY_LEN_MAX {
                let message = format!("{key} is longer than {KEY_LEN_MAX} bytes");
                return Err(ControlError::Invalid(message));
            }
        }
        let _place = self.requests.enter(submission.config_json.len())?;
        let checked = self.requests.check(move || submission.check()).await?;
        let CheckedSubmission { new, warnings } = checked?;
        // In a task of its own: what is stored must reach the driver even if the
        // client goes away meanwhile.
        let (store, events) = (self.store.clone(), self.events.clone());
        let memory_budget = self.memory_budget;
        let placing = tokio::spawn(async move {
            let placing =
                store.try_write(move |store| place(store, new, resume_unfinished, memory_budget));
            run(placing.await?, &events).await
        });
        let id = placing.await.map_err(|_| ControlError::Panicked("storing the experiment"))??;
        Ok(Submitted { experiment: self.find(id).await?, warnings })
    }
}

/// Hands what has been placed to the driver, if it is to run.
async fn run(placement: Placement, events: &EventSender) -> Result<ExperimentId, ControlError> {
    match placement {
        Placement::Runs(runnable) => {
            failpoint::reached("experiment stored");
            let id = runnable.id;
            info!(experiment = %id, name = runnable.config.name, "experiment submitted");
            let ready = DriverEvent::ExperimentReady(runnable);
            events.send(ready).await.map_err(|_| ControlError::ShuttingDown)?;
            Ok(id)
        }
        Placement::RunsAlready(id) => Ok(id),
        Placement::TooMany => Err(ControlError::TooManyUnfinished),
        Placement::NoMemory(shortage) => Err(ControlError::NoMemory(shortage)),
    }
}

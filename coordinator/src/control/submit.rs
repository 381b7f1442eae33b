//! Submits an experiment: checks it, stores it, and hands it to the driver.

use tracing::info;

use crate::{
    driver::{DriverEvent, EventSender},
    failpoint,
    ids::ExperimentId,
    labels,
    limits::KEY_LEN_MAX,
    queries::{QueryError, StoredGeneration},
    store::{ExperimentRecord, Store},
    submission::{CheckedSubmission, Parent, Submission},
};

use super::{
    Control, ControlError,
    placement::{Existing, Placement, place},
};

/// A submission that was accepted.
#[derive(Debug)]
pub struct Submitted {
    /// The experiment that it has led to.
    pub experiment: ExperimentRecord,
    /// Keys of the file without effect, and parameters that keep their defaults; one
    /// line each.
    pub warnings: Vec<String>,
    /// An identical experiment; `experiment` itself if it existed already.
    pub identical: Option<ExperimentId>,
}

impl Control {
    /// Submits an experiment. `existing`: how an identical experiment in the database may satisfy
    /// this request. `fork_of`: the generation of another experiment after which this one
    /// continues.
    pub async fn submit(
        &self,
        submission: Submission,
        existing: Existing,
        fork_of: Option<(ExperimentId, u64)>,
    ) -> Result<Submitted, ControlError> {
        let request_id = submission.request_id.as_deref().unwrap_or_default();
        for (key, value) in [("request_id", request_id), ("default_name", &submission.default_name)]
        {
            if value.len() > KEY_LEN_MAX {
                let message = format!("{key} is longer than {KEY_LEN_MAX} bytes");
                return Err(ControlError::Invalid(message));
            }
        }
        labels::check(&submission.labels).map_err(ControlError::Invalid)?;
        let _place = self.requests.enter(submission.config_json.len())?;
        // Requests that wait for their turn must not hold a generation of tens of megabytes.
        let turn = self.requests.turn(self.client).await;
        let stored = match fork_of {
            Some((id, generation)) => {
                let read = move |store: &Store| StoredGeneration::read(store, id, generation);
                Some(self.store.read(read).await?)
            }
            None => None,
        };
        let check = move |goes_on: &dyn Fn() -> bool| {
            let parent = match stored {
                Some(stored) => {
                    let evolution = stored.repeat()?.after;
                    Some(Parent { experiment: stored.experiment, evolution })
                }
                None => None,
            };
            Ok::<_, QueryError>(Submission { parent, ..submission }.check(goes_on))
        };
        let checked = self.requests.check_in(turn, check).await??;
        let CheckedSubmission { new, warnings } = checked?;
        // In a task of its own: the driver must hear of a stored experiment even if the client
        // goes away meanwhile.
        let (store, events) = (self.store.clone(), self.events.clone());
        let memory_budget = self.memory_budget;
        let placing = tokio::spawn(async move {
            let placing = store.try_write(move |store| place(store, new, existing, memory_budget));
            let (placement, identical) = placing.await?;
            Ok::<_, ControlError>((run(placement, &events).await?, identical))
        });
        let (id, identical) =
            placing.await.map_err(|_| ControlError::Panicked("storing the experiment"))??;
        self.take_up_if_left(id).await?;
        Ok(Submitted { experiment: self.find(id).await?, warnings, identical })
    }
}

/// Hands a placed experiment to the driver, if it has to run.
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

//! What clients want of experiments: cancel, pause, resume, reprioritise.

use tokio::sync::oneshot;
use tracing::{error, info};

use crate::{clock, ids::ExperimentId, store::ExperimentState};

use super::{Change, Driver, Entry, Request};

/// Why an experiment is over that a client cancelled.
const CANCELLED: &str = "cancelled by a client";

impl Driver {
    /// An experiment that the driver does not know has ended, or waits for another
    /// version of the program; only the store is concerned.
    pub(super) fn on_request(
        &mut self,
        id: ExperimentId,
        request: Request,
        reply: oneshot::Sender<()>,
    ) {
        let change = match request {
            Request::Cancel => {
                if let Some(running) = self.experiments.get_mut(&id) {
                    running.cancellations.push(reply);
                    self.end(id, ExperimentState::Cancelled, CANCELLED.to_owned());
                    return;
                }
                Change::State(ExperimentState::Cancelled, CANCELLED.to_owned())
            }
            Request::Pause(reason) => {
                info!(experiment = %id, reason, "experiment paused");
                self.engine.on_job_paused(clock::now(), id.into());
                Change::State(ExperimentState::Paused, reason)
            }
            Request::Resume => {
                info!(experiment = %id, "experiment resumed");
                self.engine.on_job_resumed(clock::now(), id.into());
                Change::State(ExperimentState::Running, String::new())
            }
            Request::SetPriority(priority) => {
                info!(experiment = %id, priority = priority.weight(), "experiment reprioritised");
                self.engine.on_priority_set(id.into(), priority);
                Change::Priority(priority)
            }
        };
        self.ledger.push(Entry { experiment: id, change, replies: vec![reply] });
    }

    /// Ends an experiment; a generation that is being stored is stored first.
    pub(super) fn end(&mut self, id: ExperimentId, state: ExperimentState, reason: String) {
        self.engine.on_job_ended(clock::now(), id.into());
        if let Some(running) = self.experiments.get_mut(&id).filter(|running| running.is_storing) {
            running.end.get_or_insert((state, reason));
            return;
        }
        let replies = match self.experiments.remove(&id) {
            Some(running) => running.cancellations,
            None => Vec::new(),
        };
        match state {
            ExperimentState::Failed => error!(experiment = %id, reason, "experiment failed"),
            _ => info!(experiment = %id, reason, "experiment {}", state.name()),
        }
        let change = Change::State(state, reason);
        self.ledger.push(Entry { experiment: id, change, replies });
    }
}

//! The connected workers and the channels to them.

use std::collections::BTreeMap;

use tokio::sync::oneshot;
use tracing::{info, warn};

use engine::{Introduction, ToWorker};

use crate::{clock, ids::WorkerId};

use super::{Driver, WorkerLink};

/// The connected workers.
pub type ConnectedWorkers = BTreeMap<WorkerId, ConnectedWorker>;

/// A connected worker.
pub struct ConnectedWorker {
    name: String,
    link: WorkerLink,
    is_draining: bool,
}

impl Driver {
    pub(super) fn on_worker_joined(
        &mut self,
        introduction: Introduction,
        link: WorkerLink,
        reply: oneshot::Sender<WorkerId>,
    ) {
        let Introduction { name, version, n_slots, experiments, .. } = introduction.clone();
        let id = self.engine.on_worker_joined(clock::engine_now(), introduction);
        // The worker is welcomed before it gets work, because commands are carried out after
        // this.
        self.workers
            .insert(id, ConnectedWorker { name: name.to_string(), link, is_draining: false });
        self.send(id, ToWorker::Welcome(id));
        self.fleet_news.send_modify(|count| *count += 1);
        let fleet = self.engine.fleet_size();
        info!(
            worker = %id, name = &*name, version, slots = n_slots, %experiments,
            workers = fleet.n_workers, total_slots = fleet.n_slots,
            "worker joined"
        );
        // If the stream is gone already, its end will be reported.
        let _ = reply.send(id);
    }

    pub(super) fn on_worker_draining(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.is_draining = true;
            info!(worker = %id, name = worker.name, "worker is draining");
        }
        self.engine.on_draining(clock::engine_now(), id);
        self.fleet_news.send_modify(|count| *count += 1);
    }

    pub(super) fn on_worker_left(&mut self, id: WorkerId, reason: &str) {
        let n_items_requeued = self.engine.on_worker_left(clock::engine_now(), id);
        self.forget_worker(id, reason, n_items_requeued);
    }

    /// Sends a worker a message; drops the worker if its outbox is full.
    pub(super) fn send(&mut self, id: WorkerId, message: ToWorker) {
        let Some(worker) = self.workers.get(&id) else { return };
        if worker.link.outbox.try_send(message).is_err() {
            self.on_worker_left(id, "it does not read its messages");
        }
    }

    /// Closes the channel to a worker that the engine has forgotten.
    pub(super) fn forget_worker(&mut self, id: WorkerId, reason: &str, items_requeued: usize) {
        let Some(ConnectedWorker { name, link, is_draining }) = self.workers.remove(&id) else {
            return;
        };
        link.dropped.cancel();
        self.fleet_news.send_modify(|count| *count += 1);
        let workers = self.engine.fleet_size().n_workers;
        if is_draining {
            info!(worker = %id, name, items_requeued, workers, "worker left");
        } else {
            warn!(worker = %id, name, reason, items_requeued, workers, "worker lost");
        }
    }
}

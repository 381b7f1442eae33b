//! An index of workers: those that can take items, and those with items that wait.

use std::collections::BTreeSet;

use model::ids::WorkerId;

use super::worker::{FULL_LOAD, Worker};

/// The workers, by what they have to do.
#[derive(Debug, Default)]
pub struct WorkerLoadIndex {
    /// Workers with credit, sorted by the time at which they would finish one more item
    /// ([`Worker::finish_rank`]), and among equals the fastest first.
    pub available: BTreeSet<(u64, u32, WorkerId)>,
    /// Workers with items that wait behind others, most loaded last.
    pub backlogged: BTreeSet<(u64, WorkerId)>,
    /// Number of usable slots without an item.
    pub n_idle_slots: usize,
    /// Number of slots that may get an item.
    pub n_usable_slots: usize,
    /// The speed of the usable slots together; a slot of pace 1 counts
    /// [`SPEED_UNIT`](super::worker::SPEED_UNIT).
    pub usable_speed: u64,
}

impl WorkerLoadIndex {
    /// Adds a worker.
    pub fn add(&mut self, id: WorkerId, worker: &Worker) {
        let load = worker.load();
        if worker.has_credit() {
            self.available.insert((worker.finish_rank(), worker.pace_rank(), id));
        }
        if load > FULL_LOAD {
            self.backlogged.insert((load, id));
        }
        self.n_idle_slots += worker.n_idle_slots();
        self.n_usable_slots += worker.n_usable_slots();
        self.usable_speed += worker.usable_speed();
    }

    /// Removes a worker, which must be in the state in which it was added.
    pub fn remove(&mut self, id: WorkerId, worker: &Worker) {
        let load = worker.load();
        if worker.has_credit() {
            self.available.remove(&(worker.finish_rank(), worker.pace_rank(), id));
        }
        if load > FULL_LOAD {
            self.backlogged.remove(&(load, id));
        }
        self.n_idle_slots -= worker.n_idle_slots();
        self.n_usable_slots -= worker.n_usable_slots();
        self.usable_speed -= worker.usable_speed();
    }
}

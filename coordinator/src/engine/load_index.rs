//! Which workers can take items, and which have items that wait.

use std::collections::BTreeSet;

use crate::ids::WorkerId;

use super::worker::{FULL_LOAD, Worker};

/// The workers, sorted by load.
#[derive(Debug, Default)]
pub struct WorkerLoadIndex {
    /// Workers with credit: that which would be done first with another item first
    /// ([`Worker::finish_rank`]), and among equals the fastest.
    pub available: BTreeSet<(u64, u32, WorkerId)>,
    /// Workers with items that wait behind others, most loaded last.
    pub backlogged: BTreeSet<(u64, WorkerId)>,
    /// Slots that may have an item and have none.
    pub n_idle_slots: usize,
    /// Slots that may have an item.
    pub n_usable_slots: usize,
    /// The work that these do in the time that one of pace 1 takes for
    /// [`SPEED_UNIT`](super::worker::SPEED_UNIT).
    pub usable_speed: u64,
}

impl WorkerLoadIndex {
    /// Sorts a worker in.
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

    /// Takes a worker out, as it was when it was added.
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

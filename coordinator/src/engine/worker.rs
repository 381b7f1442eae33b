//! A connected worker, as the engine sees it.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Instant,
};

use crate::ids::{ExperimentId, ItemId};

use super::{CREDITS_PER_SLOT, generation::Task};

/// A connected worker.
#[derive(Debug)]
pub struct Worker {
    /// What it calls itself.
    pub name: String,
    /// Items it computes at the same time.
    pub n_slots: usize,
    /// When it last gave a sign of life.
    pub last_heard: Instant,
    /// Whether it wants no more items.
    pub is_draining: bool,
    /// Experiments whose specification it has.
    pub known_experiments: BTreeSet<ExperimentId>,
    /// What it has been given and has not answered; oldest first, as ids grow.
    pub in_flight: BTreeMap<ItemId, Assignment>,
}

/// Work in a worker's hands.
#[derive(Debug)]
pub struct Assignment {
    /// Whose work.
    pub experiment: ExperimentId,
    /// Which work.
    pub task: Task,
}

impl Worker {
    /// A worker without work.
    pub fn new(name: &str, n_slots: usize, now: Instant) -> Self {
        Self {
            name: name.to_owned(),
            n_slots,
            last_heard: now,
            is_draining: false,
            known_experiments: BTreeSet::new(),
            in_flight: BTreeMap::new(),
        }
    }

    /// Whether it may be given another item.
    pub fn has_credit(&self) -> bool {
        !self.is_draining && self.in_flight.len() < CREDITS_PER_SLOT * self.n_slots
    }

    /// Items in flight per slot, in units of 2^-20.
    pub fn load(&self) -> u64 {
        ((self.in_flight.len() as u64) << 20) / self.n_slots as u64
    }

    /// Gives it work.
    pub fn assign(&mut self, item: ItemId, experiment: ExperimentId, task: Task) {
        self.in_flight.insert(item, Assignment { experiment, task });
    }
}

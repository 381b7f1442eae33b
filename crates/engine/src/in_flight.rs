//! The items assigned to a worker that have no result yet.

use std::{
    collections::{BTreeMap, btree_map::IntoIter},
    ops::Deref,
    time::Duration,
};

use model::ids::{AssignmentId, JobId};
use sim_core::TrialSet;

use super::{Instant, item::Item};

/// Why a worker computes an item; each kind has a queue of its own in a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ItemKind {
    /// It has no result.
    Ordinary,
    /// It has no result, and is a suspect; a worker has one such item at a time.
    Suspect,
    /// Only for comparison.
    Audit,
}

/// An item that a worker has.
#[derive(Debug, Clone)]
pub struct AssignedItem {
    /// Its job.
    pub job: JobId,
    /// The trial set of its batch.
    pub trial_set: TrialSet,
    /// The item.
    pub item: Item,
    /// Why the worker computes it.
    pub kind: ItemKind,
    /// When it was sent.
    pub assigned: Instant,
    /// When it should be done.
    pub expected: Instant,
    /// Time that its job was charged for it.
    pub charge: Duration,
}

impl AssignedItem {
    /// Whether it is computed only for comparison.
    pub fn is_audit(&self) -> bool {
        self.kind == ItemKind::Audit
    }
}

/// Items by assignment, oldest first because ids grow, and the sum of their trials.
#[derive(Debug, Default)]
pub struct InFlight {
    items: BTreeMap<AssignmentId, AssignedItem>,
    n_trials: usize,
}

impl InFlight {
    /// Number of trials of all items.
    pub fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// Adds an item.
    pub fn insert(&mut self, id: AssignmentId, item: AssignedItem) {
        self.n_trials += item.item.trials.len();
        let former = self.items.insert(id, item);
        assert!(former.is_none(), "an assignment is given once");
    }

    /// Removes an item.
    pub fn remove(&mut self, id: AssignmentId) -> Option<AssignedItem> {
        let item = self.items.remove(&id)?;
        self.n_trials -= item.item.trials.len();
        Some(item)
    }

    /// Removes the items of a job.
    pub fn remove_of(&mut self, job: JobId) -> Vec<(AssignmentId, AssignedItem)> {
        let removed: Vec<_> = self.items.extract_if(.., |_, item| item.job == job).collect();
        self.n_trials -=
            removed.iter().map(|(_, assigned)| assigned.item.trials.len()).sum::<usize>();
        removed
    }
}

impl Deref for InFlight {
    type Target = BTreeMap<AssignmentId, AssignedItem>;

    fn deref(&self) -> &Self::Target {
        &self.items
    }
}

impl IntoIterator for InFlight {
    type Item = (AssignmentId, AssignedItem);
    type IntoIter = IntoIter<AssignmentId, AssignedItem>;

    fn into_iter(self) -> Self::IntoIter {
        self.items.into_iter()
    }
}

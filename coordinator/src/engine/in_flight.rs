//! The items assigned to a worker that have no result yet.

use std::{
    collections::{BTreeMap, btree_map::IntoIter},
    ops::Deref,
};

use crate::ids::{AssignmentId, JobId};

use super::worker::AssignedItem;

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

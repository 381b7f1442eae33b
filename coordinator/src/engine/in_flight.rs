//! The items that a worker has been given and has not answered.

use std::{
    collections::{BTreeMap, btree_map::IntoIter},
    ops::Deref,
};

use crate::ids::{AssignmentId, JobId};

use super::worker::AssignedItem;

/// Items by assignment, oldest first, as ids grow; and how many trials they have.
#[derive(Debug, Default)]
pub struct InFlight {
    items: BTreeMap<AssignmentId, AssignedItem>,
    n_trials: usize,
}

impl InFlight {
    /// Trials of all of them.
    pub fn n_trials(&self) -> usize {
        self.n_trials
    }

    /// Adds one.
    pub fn insert(&mut self, id: AssignmentId, item: AssignedItem) {
        self.n_trials += item.item.trials.len();
        let former = self.items.insert(id, item);
        assert!(former.is_none(), "an assignment is given once");
    }

    /// Takes one out.
    pub fn remove(&mut self, id: AssignmentId) -> Option<AssignedItem> {
        let item = self.items.remove(&id)?;
        self.n_trials -= item.item.trials.len();
        Some(item)
    }

    /// Takes those of a job out.
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

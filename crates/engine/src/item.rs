//! The unit of scheduling: one genotype on a range of trials, and its states.

use std::ops::Range;

/// One individual of a batch on a range of trials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Index of the individual among the batch's genotypes.
    pub individual: u32,
    /// The trials to run.
    pub trials: Range<u32>,
}

/// The state of a trial of a batch. The trials of an item share it until the item is divided.
/// Where several states apply, the last of them counts: workers may still compute duplicates of a
/// referred item, and a result of a duplicate makes the item done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ItemState {
    /// It waits in a queue of the batch, in exactly one item.
    Queued,
    /// One or more workers compute it.
    Assigned,
    /// No worker gets it before a certain time, because workers were lost while they computed it.
    Delayed,
    /// It is referred to the referee: no worker gets it until the answer.
    Referred,
    /// Its result is known.
    Done,
}

impl Item {
    /// Its contiguous parts whose trials satisfy a condition.
    pub fn parts(&self, is_in: impl Fn(u32) -> bool) -> Vec<Self> {
        let individual = self.individual;
        let mut parts: Vec<Self> = Vec::new();
        for trial in self.trials.clone().filter(|&trial| is_in(trial)) {
            match parts.last_mut() {
                Some(part) if part.trials.end == trial => part.trials.end += 1,
                _ => parts.push(Self { individual, trials: trial..trial + 1 }),
            }
        }
        parts
    }

    /// Whether it includes a trial of an individual.
    pub fn includes(&self, individual: u32, trial: u32) -> bool {
        self.individual == individual && self.trials.contains(&trial)
    }

    /// Whether two items have a trial in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        let Range { start, end } = self.trials;
        self.individual == other.individual && start < other.trials.end && other.trials.start < end
    }
}

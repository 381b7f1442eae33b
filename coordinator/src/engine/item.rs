//! The unit of scheduling: one genotype on a range of trials.

use std::ops::Range;

/// One individual of a batch on a range of trials.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Item {
    /// Index of the individual among the batch's genotypes.
    pub individual: u32,
    /// The trials to run.
    pub trials: Range<u32>,
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
}

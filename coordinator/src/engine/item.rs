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

//! Ids, each its own type, so that none is taken for another.

use std::fmt;

use serde::{Deserialize, Serialize};

/// An experiment; numbered from 1 by the store, never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ExperimentId(pub u64);

/// A worker's connection; a worker that reconnects gets another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

/// One assignment of work to one worker; an item that is assigned again gets
/// another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ItemId(pub u64);

/// Where the numbers of evaluations begin: no store gets there.
const EVALUATIONS: u64 = 1 << 63;

impl ExperimentId {
    /// An evaluation, which is no experiment of the store; numbered from 1 by the
    /// driver.
    pub fn evaluation(number: u64) -> Self {
        Self(EVALUATIONS | number)
    }

    /// Whether it is an evaluation.
    pub fn is_evaluation(self) -> bool {
        self.0 & EVALUATIONS != 0
    }
}

impl fmt::Display for ExperimentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_evaluation() {
            return write!(f, "evaluation {}", self.0 & !EVALUATIONS);
        }
        self.0.fmt(f)
    }
}

impl fmt::Display for WorkerId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for ItemId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

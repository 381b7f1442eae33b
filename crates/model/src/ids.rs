//! Ids, each its own type, so that none is taken for another.

use std::fmt;

use serde::{Deserialize, Serialize};

/// An experiment; numbered from 1 by the store, never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ExperimentId(pub u64);

/// An evaluation, which nothing is stored of; numbered from 1 by the driver since
/// the coordinator's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EvaluationId(pub u64);

/// What the engine schedules. Experiments come before evaluations in its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JobId {
    /// An experiment of the store.
    Experiment(ExperimentId),
    /// An evaluation of one genotype.
    Evaluation(EvaluationId),
}

impl JobId {
    /// The experiment, if it is one.
    pub const fn experiment(self) -> Option<ExperimentId> {
        match self {
            Self::Experiment(id) => Some(id),
            Self::Evaluation(_) => None,
        }
    }
}

impl From<ExperimentId> for JobId {
    fn from(id: ExperimentId) -> Self {
        Self::Experiment(id)
    }
}

impl From<EvaluationId> for JobId {
    fn from(id: EvaluationId) -> Self {
        Self::Evaluation(id)
    }
}

/// A worker's connection; a worker that reconnects gets another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

/// An item given to a worker; an item that is given to another worker, or again,
/// gets another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AssignmentId(pub u64);

/// Something that the referee is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct QuestionId(pub u64);

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Experiment(id) => write!(f, "experiment {id}"),
            Self::Evaluation(id) => write!(f, "evaluation {id}"),
        }
    }
}

macro_rules! display_number {
    ($($id:ty),*) => {
        $(impl fmt::Display for $id {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        })*
    };
}

display_number!(ExperimentId, EvaluationId, WorkerId, AssignmentId, QuestionId);

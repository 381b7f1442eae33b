//! Ids, each a type of its own, so that code cannot confuse them.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Id of an experiment; the store numbers them from 1 and never reuses one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ExperimentId(pub u64);

/// Id of an evaluation, whose results are not stored; the driver numbers them from 1 since the
/// coordinator's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct EvaluationId(pub u64);

/// Id of a job, the unit that the engine schedules. Experiments sort before evaluations.
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

/// Id of a worker's connection; a worker that reconnects gets another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WorkerId(pub u64);

/// Id of an assignment; an item that is assigned again gets another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AssignmentId(pub u64);

/// Id of a question for the referee.
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

//! One run and its stage.

use std::{mem, sync::Arc};

use experiment_file::ExperimentConfig;

use crate::{
    ids::ExperimentId,
    store::{ExperimentState, GenerationRecord},
};

use super::{ReadyToCommit, RequestId, Round, RunId};

/// An experiment that has not ended.
#[derive(Debug)]
pub struct Run {
    /// Its configuration.
    pub config: Arc<ExperimentConfig>,
    /// Estimated bytes that it takes once it is loaded.
    pub memory: u64,
    /// Distinguishes this run from former ones of the same experiment, before it was reopened.
    pub run_epoch: u64,
    /// The latest generation that is on disk.
    pub latest: Option<GenerationRecord>,
    /// The stage of the generation after the one in commit.
    pub stage: Stage,
    /// The generation in commit.
    pub committing: Option<Committing>,
    /// How it ends, once the generation in commit is stored.
    pub end: Option<End>,
    /// The requests that wait for its end.
    pub cancellations: Vec<RequestId>,
}

/// The stage of a generation before its commit.
#[derive(Debug)]
pub enum Stage {
    /// It waits for memory.
    Waiting,
    /// Its evolution cannot be read from the store; it is paused.
    Unreadable,
    /// Its evolution is being read from the store.
    Loading,
    /// The fleet evaluates a batch.
    Evaluating(Round),
    /// A task concludes the round.
    Concluding,
    /// It waits for the previous commit.
    ReadyToCommit(Box<ReadyToCommit>),
    /// No generation is left: the last one is in commit.
    NoneLeft,
}

/// A generation in commit.
#[derive(Debug)]
pub struct Committing {
    /// Its row of the history.
    pub generation: GenerationRecord,
    /// Whether it completes the experiment.
    pub is_last: bool,
}

/// The end of a run that does not complete its generations.
#[derive(Debug)]
pub struct End {
    /// Failed or cancelled.
    pub state: ExperimentState,
    /// For the experiment's owner.
    pub reason: String,
}

impl Run {
    /// A run that waits to be loaded. `memory`: bytes that it takes once loaded.
    pub fn new(
        config: ExperimentConfig,
        run_epoch: u64,
        latest: Option<GenerationRecord>,
        memory: u64,
    ) -> Self {
        Self {
            config: Arc::new(config),
            memory,
            run_epoch,
            latest,
            stage: Stage::Waiting,
            committing: None,
            end: None,
            cancellations: Vec::new(),
        }
    }

    /// Its id; `experiment`: its experiment.
    pub fn id(&self, experiment: ExperimentId) -> RunId {
        RunId { experiment, run_epoch: self.run_epoch }
    }

    /// Whether it waits for memory.
    pub fn is_waiting(&self) -> bool {
        matches!(self.stage, Stage::Waiting)
    }

    /// Whether it takes memory.
    pub fn has_memory(&self) -> bool {
        !matches!(self.stage, Stage::Waiting | Stage::Unreadable)
    }

    /// Takes the round that the fleet has evaluated, if any, to conclude it.
    pub fn take_round(&mut self) -> Option<Round> {
        match mem::replace(&mut self.stage, Stage::Concluding) {
            Stage::Evaluating(round) => Some(round),
            other => {
                self.stage = other;
                None
            }
        }
    }

    /// Takes the generation that is ready to commit, if any.
    pub fn take_ready(&mut self) -> Option<Box<ReadyToCommit>> {
        match mem::replace(&mut self.stage, Stage::NoneLeft) {
            Stage::ReadyToCommit(ready) => Some(ready),
            other => {
                self.stage = other;
                None
            }
        }
    }
}

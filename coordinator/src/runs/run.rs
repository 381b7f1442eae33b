//! One run and where it stands.

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
    /// Bytes that it takes once it is loaded, about.
    pub memory: u64,
    /// Tells this run from former ones of the same experiment, before more
    /// generations were asked for.
    pub run_epoch: u64,
    /// The latest generation that is on disk.
    pub latest: Option<GenerationRecord>,
    /// Where the generation stands that comes after the one being committed.
    pub stage: Stage,
    /// The generation that is being committed.
    pub committing: Option<Committing>,
    /// How it ends, as soon as the generation that is being committed is stored.
    pub end: Option<End>,
    /// The requests that wait for its end.
    pub cancellations: Vec<RequestId>,
}

/// Where a generation stands that is not being committed yet.
#[derive(Debug)]
pub enum Stage {
    /// There is no memory for it yet.
    Waiting,
    /// Its evolution cannot be read from the store; it is paused.
    Unreadable,
    /// Its evolution is being read from the store.
    Loading,
    /// The fleet evaluates a batch.
    Evaluating(Round),
    /// Conclusions are being drawn.
    Concluding,
    /// It waits for the commit before it.
    ReadyToCommit(Box<ReadyToCommit>),
    /// There is none: the last one is being committed.
    NoneLeft,
}

/// A generation that is being committed.
#[derive(Debug)]
pub struct Committing {
    /// Its row of the history.
    pub generation: GenerationRecord,
    /// Whether the experiment is completed by it.
    pub is_last: bool,
}

/// How a run ends otherwise than by completing its generations.
#[derive(Debug)]
pub struct End {
    /// Failed or cancelled.
    pub state: ExperimentState,
    /// For the experiment's owner.
    pub reason: String,
}

impl Run {
    /// A run that waits to be loaded. `memory`: bytes that it takes then.
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

    /// What it is called; `experiment`: its experiment.
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

    /// Takes the round that the fleet has evaluated, if there is one: conclusions are
    /// drawn from it now.
    pub fn take_round(&mut self) -> Option<Round> {
        match mem::replace(&mut self.stage, Stage::Concluding) {
            Stage::Evaluating(round) => Some(round),
            other => {
                self.stage = other;
                None
            }
        }
    }

    /// Takes the generation that is ready to be committed, if there is one.
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

//! Checkpoints: what evolution goes on from, as bytes.
//!
//! A checkpoint is a *state* and the *steps* since it. The state is everything. A step is
//! the fitness that evolution was told for one generation: `ask` and `tell` are functions,
//! so the state after the generation follows from it. Where a step is much shorter (a GA's
//! state is its population, CMA-ES's a matrix), most generations add a step, and few a
//! state.
//!
//! State and steps begin with a byte for the version of their format; the rest is in the
//! format of postcard (fields in order, without names; numbers as little-endian IEEE 754).

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::{Evolution, EvolutionError};

/// Version of the format.
const VERSION: u8 = 1;

/// The state is written anew after so many generations at the latest: whoever resumes takes
/// fewer steps than that.
const STEPS_MAX: u64 = 8;

/// What an evolution can be restored from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// Evolution after some generation.
    pub state: Vec<u8>,
    /// The generations since, in order.
    pub steps: Vec<Vec<u8>>,
}

/// What a generation changes in a checkpoint.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Advance {
    /// Replaces the checkpoint.
    State(Vec<u8>),
    /// Is added to its steps.
    Step(Vec<u8>),
}

/// What evolution was told in one generation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Step {
    /// Per individual the fitness of every trial.
    pub trial_fitness: Vec<Vec<f64>>,
    /// Per block of the re-evaluation after it the same of every candidate that met it; none
    /// if there was no re-evaluation.
    pub blocks: Vec<Vec<Vec<f64>>>,
}

/// Why there is no evolution in a checkpoint. It is damaged, or of another version.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Written by another version.
    #[error("it has the format {found}, and this program reads {VERSION}")]
    Version {
        /// Its first byte.
        found: u8,
    },
    /// Cut off, or no such values.
    #[error("it cannot be read: {0}")]
    Malformed(#[from] postcard::Error),
    /// A step of another experiment, say.
    #[error("the step of generation {generation} does not fit")]
    Step {
        /// Index of the generation.
        generation: u64,
    },
    /// A step that evolution cannot have taken.
    #[error(transparent)]
    Evolution(#[from] EvolutionError),
}

impl Evolution {
    /// Everything, for a new checkpoint.
    pub fn state(&self) -> Vec<u8> {
        encode(self)
    }

    fn state_len(&self) -> usize {
        postcard::experimental::serialized_size(self).expect("numbers and lists serialise")
    }

    /// What the latest generation changes in the checkpoint that the generation before it
    /// left.
    pub fn advance(&self) -> Advance {
        let is_due = self.n_generations.is_multiple_of(STEPS_MAX);
        match self.step.as_ref().filter(|_| !is_due).map(encode) {
            Some(step) if 2 * step.len() < self.state_len() => Advance::Step(step),
            _ => Advance::State(self.state()),
        }
    }

    /// The evolution that a checkpoint is of.
    pub fn restore(checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        let mut evolution: Self = decode(&checkpoint.state)?;
        for step in &checkpoint.steps {
            evolution.take(decode(step)?)?;
        }
        Ok(evolution)
    }

    /// Goes through a generation again.
    fn take(&mut self, step: Step) -> Result<(), CheckpointError> {
        let generation = self.ask();
        let misfit = CheckpointError::Step { generation: generation.index };
        if step.trial_fitness.len() != generation.genotypes.len() {
            return Err(misfit);
        }
        self.tell(generation, &step.trial_fitness)?;
        if step.blocks.is_empty() {
            return Ok(());
        }
        let Some(mut round) = self.reevaluation() else { return Err(misfit) };
        for block in &step.blocks {
            if round.genotypes().len() != block.len() {
                return Err(misfit);
            }
            round.learn(block);
        }
        if !round.is_over() {
            return Err(misfit);
        }
        self.set_champion(&round);
        Ok(())
    }
}

pub(crate) fn encode(value: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(value, vec![VERSION]).expect("numbers and lists serialise")
}

pub(crate) fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CheckpointError> {
    match bytes.split_first() {
        Some((&VERSION, rest)) => Ok(postcard::from_bytes(rest)?),
        Some((&found, _)) => Err(CheckpointError::Version { found }),
        None => Err(CheckpointError::Malformed(postcard::Error::DeserializeUnexpectedEnd)),
    }
}

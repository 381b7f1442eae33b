//! What evolution is told, generation by generation: the fitness log.
//!
//! [`ask`](super::Evolution::ask) and [`tell`](super::Evolution::tell) are functions, so whoever
//! has the log and one state of evolution has every later state, and every genotype that was
//! ever asked for: [`replay`](super::Evolution::replay) goes through them.
//!
//! An entry begins with a byte for the version of its format; the rest is in the format of
//! postcard, as in checkpoints.

use serde::{Deserialize, Serialize};

use super::{
    CheckpointError,
    wire::{decode, encode},
};

/// Version of the format.
const VERSION: u8 = 2;

/// The version before, which says nothing of the end of a run.
const WITHOUT_END: u8 = 1;

/// An entry of the fitness log: what evolution was told of one generation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Per individual the fitness of every trial.
    pub trial_fitness: Vec<Vec<f64>>,
    /// Per block of the re-evaluation after it the same of every candidate that met it; none
    /// if there was no re-evaluation, or if it is that of [`end`](Self::end).
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// What was evaluated because the run was over.
    pub end: End,
}

/// What is evaluated when a run is over. A longer run goes on as if it had not been.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// The blocks of a re-evaluation that was not due otherwise.
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// The champion's fitness in every trial of its judgement; none without a judgement.
    pub judgement: Vec<f64>,
}

impl Told {
    /// A generation after which there is no re-evaluation.
    pub fn from_fitness(trial_fitness: Vec<Vec<f64>>) -> Self {
        Self { trial_fitness, ..Self::default() }
    }

    /// As it is stored.
    pub fn to_bytes(&self) -> Vec<u8> {
        encode(VERSION, self)
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote, in this version or the one before.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        if bytes.first() == Some(&WITHOUT_END) {
            let (trial_fitness, blocks) = decode(WITHOUT_END, bytes)?;
            return Ok(Self { trial_fitness, blocks, end: End::default() });
        }
        decode(VERSION, bytes)
    }
}

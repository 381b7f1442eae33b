//! The fitness log: the input of evolution, generation by generation.
//!
//! [`ask`](super::Evolution::ask) and [`tell`](super::Evolution::tell) are pure functions, so the
//! log and one state of evolution determine every later state, and every genotype:
//! [`replay`](super::Evolution::replay) repeats them.
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

/// The previous version, which lacks the end of a run.
const WITHOUT_END: u8 = 1;

/// An entry of the fitness log: the input of evolution for one generation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Fitness of every individual in every trial; shape `[individual][trial]`.
    pub trial_fitness: Vec<Vec<f64>>,
    /// Fitness in the re-evaluation after the generation; shape `[block][candidate][trial]`. Empty
    /// without a re-evaluation, or if the re-evaluation is in [`end`](Self::end).
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// The evaluations at the end of the run.
    pub end: End,
}

/// The evaluations at the end of a run. If the run is continued, they have no effect.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// The blocks of an extra re-evaluation, as in [`Told::blocks`].
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// The champion's fitness in every trial of its judgement; empty without a judgement.
    pub judgement: Vec<f64>,
}

impl Told {
    /// An entry of a generation without a re-evaluation.
    pub fn from_fitness(trial_fitness: Vec<Vec<f64>>) -> Self {
        Self { trial_fitness, ..Self::default() }
    }

    /// The entry as bytes, for storage.
    pub fn to_bytes(&self) -> Vec<u8> {
        encode(VERSION, self)
    }

    /// Reads the bytes of [`to_bytes`](Self::to_bytes), of this version or the previous one.
    ///
    /// # Errors
    ///
    /// If the bytes are damaged, or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        if bytes.first() == Some(&WITHOUT_END) {
            let (trial_fitness, blocks) = decode(WITHOUT_END, bytes)?;
            return Ok(Self { trial_fitness, blocks, end: End::default() });
        }
        decode(VERSION, bytes)
    }
}

//! Checkpoints: the bytes from which evolution continues.
//!
//! A checkpoint is a *keyframe* and the entries of the [fitness log](super::Told) since. A keyframe
//! is the whole state of evolution; an entry is the fitness of one generation, from which the next
//! state follows. Keyframes that are far apart take little room, but repeating the generations
//! between them takes long. [`Evolution::is_keyframe_due`] balances room and time.
//!
//! A keyframe begins with a byte for the version of its format; the rest is in the
//! format of postcard (fields in order, without names; numbers as little-endian IEEE 754).

use experiment_file::Keeps;

use super::{
    Algorithm, Evolution, EvolutionError, Told,
    wire::{decode, encode},
};

/// Version of the format of keyframes.
pub(crate) const VERSION: u8 = 1;

/// Target for the time to repeat the generations between two keyframes, ns.
const REPEAT_NS: u64 = 600_000_000;

/// Most generations between two keyframes. Large keyframes are farther apart, so that they take at
/// most [`ROOM_PER_GENERATION`].
const GENERATIONS_MAX: u64 = 150;

/// Most bytes of keyframes per generation, if the log takes less. For large populations and
/// matrices, this limit determines the distance between keyframes.
const ROOM_PER_GENERATION: u64 = 128 << 10;

/// The data from which an evolution can be restored.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Checkpoint {
    /// The state of evolution after some generation.
    pub keyframe: Vec<u8>,
    /// The later entries of the log, in order.
    pub log: Vec<Vec<u8>>,
    /// Number of latest generations before the keyframe in which all individuals had the same
    /// fitness, up to [`FLAT_COUNTED_MAX`](crate::FLAT_COUNTED_MAX).
    pub n_flat: u64,
}

/// Why a checkpoint cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Written by another version.
    #[error("it has the format {found}, but this program reads {supported}")]
    Version {
        /// Its first byte.
        found: u8,
        /// The version that this program reads.
        supported: u8,
    },
    /// The bytes are cut off, or encode no valid values.
    #[error("it cannot be read: {0}")]
    Malformed(#[from] postcard::Error),
    /// The values of a state contradict each other or exceed the limits.
    #[error("it is not the state of a run: its parts contradict each other, or exceed the limits")]
    Unsound,
    /// A log entry does not fit the state, for example because it belongs to another experiment.
    #[error("the fitness of generation {generation} does not fit the state of evolution")]
    Misfit {
        /// Index of the generation.
        generation: u64,
    },
    /// The log has fitness from which evolution cannot have learnt.
    #[error(transparent)]
    Evolution(#[from] EvolutionError),
}

impl Evolution {
    /// The whole state as bytes, for a keyframe.
    pub fn keyframe(&self) -> Vec<u8> {
        encode(VERSION, self)
    }

    /// Whether a keyframe is due after the latest generation. `entry_len`: bytes of its entry in
    /// the log.
    pub fn is_keyframe_due(&self, entry_len: usize) -> bool {
        self.n_generations.is_multiple_of(self.keyframe_interval(entry_len as u64))
    }

    /// Generations from a keyframe to the next.
    fn keyframe_interval(&self, entry_len: u64) -> u64 {
        let sum = |number: fn(&Algorithm, u64) -> u64| {
            let of_each = self
                .populations
                .iter()
                .map(|population| number(population, self.population_size as u64));
            of_each.sum::<u64>().max(1)
        };
        let for_time = (REPEAT_NS / sum(generation_ns)).clamp(1, GENERATIONS_MAX);
        let for_room = sum(state_len) / entry_len.max(ROOM_PER_GENERATION);
        for_time.max(for_room)
    }

    /// Restores the evolution of a checkpoint.
    ///
    /// # Errors
    ///
    /// If the checkpoint is damaged, of another version, or combines a keyframe and a log of
    /// different experiments.
    pub fn restore(checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        let evolution: Self = decode(VERSION, &checkpoint.keyframe)?;
        if !evolution.populations.iter().all(Algorithm::is_sound) {
            return Err(CheckpointError::Unsound);
        }
        let mut evolution = evolution.after_flat(checkpoint.n_flat);
        for entry in &checkpoint.log {
            evolution.repeat(&Told::from_bytes(entry)?)?;
        }
        Ok(evolution)
    }
}

/// Estimated time to ask for and tell a generation, ns (`cargo bench -p evolution`).
fn generation_ns(algorithm: &Algorithm, population_size: u64) -> u64 {
    let d = algorithm.n_genes() as u64;
    let drawn = 20 * population_size * d;
    // The time of decompositions and of products with matrices, which share the individuals.
    let of_matrices = |n: u64| if n == 0 { 0 } else { d * d * (n * d + population_size) / 2 };
    match algorithm.keeps() {
        // Surviving takes about as long as drawing.
        Keeps::Repertoire => {
            let search_ns = algorithm.behaviours().map_or(0, |of| of.search_ns(population_size));
            (2 * drawn + of_matrices(n_matrices(algorithm))).saturating_add(search_ns)
        }
        Keeps::Vectors | Keeps::Population => drawn,
        Keeps::Matrix => drawn + of_matrices(1),
    }
}

fn n_matrices(algorithm: &Algorithm) -> u64 {
    algorithm.behaviours().map_or(0, |behaviours| behaviours.n_matrices() as u64)
}

/// Estimated size of a state, bytes.
fn state_len(algorithm: &Algorithm, population_size: u64) -> u64 {
    let d = algorithm.n_genes() as u64;
    let n_numbers = match algorithm.keeps() {
        Keeps::Vectors => 6 * d,
        Keeps::Matrix => d * d + algorithm.n_kept() as u64,
        Keeps::Population => population_size * d,
        Keeps::Repertoire => {
            let n_kept = algorithm.behaviours().map_or(0, |behaviours| behaviours.n_kept() as u64);
            n_kept * d + n_matrices(algorithm) * d * d / 2
        }
    };
    n_numbers * size_of::<f64>() as u64
}

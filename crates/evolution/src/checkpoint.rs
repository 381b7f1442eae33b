//! Checkpoints: what evolution goes on from, as bytes.
//!
//! A checkpoint is a *keyframe* and the entries of the [fitness log](super::Told) since. A
//! keyframe is everything that evolution is; an entry is what it was told of one generation,
//! from which the next state follows. Where keyframes are far apart they take little room, and
//! going through the entries takes long: [`Evolution::is_keyframe_due`] weighs one against the
//! other.
//!
//! A keyframe begins with a byte for the version of its format; the rest is in the
//! format of postcard (fields in order, without names; numbers as little-endian IEEE 754).

use experiment_file::Keeps;

use super::{
    Algorithm, Evolution, EvolutionError, Told,
    algorithms::Strategy as _,
    wire::{decode, encode},
};

/// Version of the format of keyframes.
pub(crate) const VERSION: u8 = 1;

/// Going through the generations between two keyframes takes about so long, ns.
const REPLAY_NS: u64 = 600_000_000;

/// Most generations between two keyframes, if those take no more room than
/// [`ROOM_PER_GENERATION`].
const GENERATIONS_MAX: u64 = 150;

/// Bytes that keyframes may take per generation, if the log takes less. For large
/// populations and matrices this is what keeps them apart.
const ROOM_PER_GENERATION: u64 = 128 << 10;

/// What an evolution can be restored from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Checkpoint {
    /// Evolution after some generation.
    pub keyframe: Vec<u8>,
    /// The entries of the log since, in order.
    pub log: Vec<Vec<u8>>,
    /// Generations up to the keyframe in which all individuals had the same fitness, as far as
    /// they are counted.
    pub n_flat: u64,
}

/// Why there is no evolution in a checkpoint. It is damaged, or of another version.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// Written by another version.
    #[error("it has the format {found}, and this program reads {supported}")]
    Version {
        /// Its first byte.
        found: u8,
        /// What it would have to be.
        supported: u8,
    },
    /// Cut off, or no such values.
    #[error("it cannot be read: {0}")]
    Malformed(#[from] postcard::Error),
    /// An entry of the log of another experiment, say.
    #[error("the fitness of generation {generation} does not fit")]
    Misfit {
        /// Index of the generation.
        generation: u64,
    },
    /// Fitness that evolution cannot have learnt from.
    #[error(transparent)]
    Evolution(#[from] EvolutionError),
}

impl Evolution {
    /// Everything, for a keyframe.
    pub fn keyframe(&self) -> Vec<u8> {
        encode(VERSION, self)
    }

    /// Whether the latest generation is one after which a keyframe is kept. `entry_len`:
    /// bytes of its entry in the log.
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
        let for_time = (REPLAY_NS / sum(generation_ns)).clamp(1, GENERATIONS_MAX);
        let for_room = sum(state_len) / entry_len.max(ROOM_PER_GENERATION);
        for_time.max(for_room)
    }

    /// The evolution that a checkpoint is of.
    pub fn restore(checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        let evolution: Self = decode(VERSION, &checkpoint.keyframe)?;
        let mut evolution = evolution.after_flat(checkpoint.n_flat);
        for entry in &checkpoint.log {
            evolution.replay(&Told::from_bytes(entry)?)?;
        }
        Ok(evolution)
    }
}

/// About how long asking and telling take, ns (`cargo bench -p evolution`).
fn generation_ns(algorithm: &Algorithm, population_size: u64) -> u64 {
    let d = algorithm.n_genes() as u64;
    let drawn = 20 * population_size * d;
    match algorithm.keeps() {
        Keeps::Vectors | Keeps::Population => drawn,
        // Of a decomposition and products with the matrix.
        Keeps::Matrix => drawn + d * d * (d + population_size) / 2,
    }
}

/// About how many bytes a state has.
fn state_len(algorithm: &Algorithm, population_size: u64) -> u64 {
    let d = algorithm.n_genes() as u64;
    let n_numbers = match algorithm.keeps() {
        Keeps::Vectors => 6 * d,
        Keeps::Matrix => d * d,
        Keeps::Population => population_size * d,
    };
    n_numbers * size_of::<f64>() as u64
}

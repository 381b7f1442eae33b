//! The distribution of a generation, from which other machines draw its genotypes.
//!
//! If an algorithm draws individuals one by one, any individual can be drawn alone, because its
//! draws have a fixed place in the stream of the generation. The result has the same bits as
//! [`Evolution::ask`]. The distribution has two to four numbers per gene, instead of one per gene
//! and individual.

use determinism::random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use super::{
    Algorithm, CheckpointError, Evolution, Genotype,
    checkpoint::VERSION,
    wire::{decode, encode},
};

/// The distribution of the genotypes of one generation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    seed: u64,
    population_size: usize,
    generation: u64,
    populations: Vec<Algorithm>,
}

impl Evolution {
    /// The distribution of the next generation, as bytes in the format of keyframes. `None` if an
    /// algorithm does not draw individuals one by one.
    pub fn distribution(&self) -> Option<Vec<u8>> {
        let are_single = self.populations.iter().all(Algorithm::draws_one_by_one);
        let Self { seed, population_size, n_generations, populations, .. } = self;
        are_single.then(|| encode(VERSION, &(seed, population_size, n_generations, populations)))
    }
}

impl Distribution {
    /// Reads the bytes of [`Evolution::distribution`].
    ///
    /// # Errors
    ///
    /// If the bytes are damaged, or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        decode(VERSION, bytes)
    }

    /// Index of the generation, from 0.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The genotype of the individual of this index, as in [`Evolution::ask`]; `None` if the
    /// index is too large.
    pub fn genotype(&self, individual: usize) -> Option<Genotype> {
        if individual >= self.population_size {
            return None;
        }
        let mut genotype = Genotype::new();
        for (stream, population) in (0..).zip(&self.populations) {
            let mut rng = stream_of(self.seed, self.generation, stream);
            genotype.extend(population.individual(individual, self.population_size, &mut rng)?);
        }
        Some(genotype)
    }
}

/// The random stream of a population of a generation.
pub(crate) fn stream_of(seed: u64, generation: u64, population: u64) -> Stream {
    Stream::new(seed, generation, 0, Purpose::Evolution, population)
}

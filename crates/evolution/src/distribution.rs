//! What a generation is drawn from, for whoever draws its genotypes elsewhere.
//!
//! Where individuals are drawn one by one, any of them can be drawn alone: its draws have
//! their place in the stream of the generation. That gives the same bits as
//! [`Evolution::ask`], and takes two to four numbers per gene instead of one per gene and
//! individual.

use determinism::random::{Purpose, Stream};
use serde::{Deserialize, Serialize};

use super::{
    Algorithm, CheckpointError, Evolution, Genotype,
    algorithms::Strategy as _,
    checkpoint::VERSION,
    wire::{decode, encode},
};

/// What the genotypes of one generation are drawn from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    seed: u64,
    population_size: usize,
    generation: u64,
    populations: Vec<Algorithm>,
}

impl Evolution {
    /// What the next generation is drawn from, as bytes in the format of keyframes; none if
    /// an algorithm does not draw individuals one by one.
    pub fn distribution(&self) -> Option<Vec<u8>> {
        let are_single = self.populations.iter().all(Algorithm::draws_one_by_one);
        let Self { seed, population_size, n_generations, populations, .. } = self;
        are_single.then(|| encode(VERSION, &(seed, population_size, n_generations, populations)))
    }
}

impl Distribution {
    /// Reads what [`Evolution::distribution`] wrote.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        decode(VERSION, bytes)
    }

    /// The generation that is drawn from it.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// The genotype that [`Evolution::ask`] gives the individual of this index; none if there
    /// is no such individual.
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

/// What a population of a generation is drawn with.
pub(crate) fn stream_of(seed: u64, generation: u64, population: u64) -> Stream {
    Stream::new(seed, generation, 0, Purpose::Evolution, population)
}

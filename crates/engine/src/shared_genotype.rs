//! A genotype that shares the memory of its population.

use std::{fmt, ops::Deref};

use evolution::{Genotype, Population};

/// One genotype of a population, without a copy of its genes.
#[derive(Clone)]
pub struct SharedGenotype {
    /// The genotypes of all individuals.
    pub population: Population,
    /// Index of the individual among them.
    pub individual: u32,
}

impl From<Genotype> for SharedGenotype {
    fn from(genotype: Genotype) -> Self {
        Self { population: [genotype].into(), individual: 0 }
    }
}

impl Deref for SharedGenotype {
    type Target = Genotype;

    fn deref(&self) -> &Genotype {
        &self.population[self.individual as usize]
    }
}

impl PartialEq for SharedGenotype {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl fmt::Debug for SharedGenotype {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

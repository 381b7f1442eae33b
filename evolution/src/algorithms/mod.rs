//! The evolutionary algorithms, all behind one interface: draw a generation,
//! learn from its fitness.

mod cma_es;
mod cumulation;
mod ga;
mod linalg;
mod openai_es;
mod sep_cma_es;
mod snes;
mod xnes;

use std::iter;

use experiment_file::{AlgorithmName, AlgorithmParams};
use numeric::random::Stream;
use serde::{Deserialize, Serialize};

use super::{Genotype, Population};
use cma_es::CmaEs;
use ga::Ga;
use openai_es::OpenAiEs;
use sep_cma_es::SepCmaEs;
use snes::Snes;
use xnes::Xnes;

/// Genes that an algorithm with a d x d matrix may have. There, a generation of
/// 100 individuals costs the coordinator half a second (CMA-ES) to one (xNES), and
/// a checkpoint 10 to 20 MB; both grow fast, the time with the cube of d.
pub const FULL_MATRIX_GENES_MAX: usize = 1000;

/// What an algorithm draws for one generation.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Genes of each individual, within \[0, 1\].
    pub genotypes: Population,
    /// The standard normal draws behind each individual, for algorithms that
    /// learn from those; else empty.
    pub normals: Vec<Vec<f64>>,
    /// What correlation makes of the normals, for algorithms that learn from
    /// both; else empty.
    pub steps: Vec<Vec<f64>>,
}

impl Sample {
    /// Individuals and the normals behind them.
    pub fn new(genotypes: Vec<Genotype>, normals: Vec<Vec<f64>>) -> Self {
        Self { genotypes: genotypes.into(), normals, steps: Vec::new() }
    }
}

/// An algorithm between two generations. Its state is plain numbers: whoever
/// restores it draws and learns the same bits.
pub trait Strategy {
    /// The mean of the distribution, if the algorithm has one.
    fn mean(&self) -> Option<&[f64]> {
        None
    }

    /// Draws `population_size` individuals. A pure function of the state and
    /// the stream.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample;

    /// Learns from a generation that [`sample`](Self::sample) drew from this
    /// state.
    ///
    /// `fitness`: one value per individual; at least one is finite. `ranking`:
    /// indices of the individuals, best first, those whose fitness is not finite
    /// last (see [`ranking`](super::ranking::ranking)).
    fn learn(&mut self, sample: &Sample, ranking: &[usize], fitness: &[f64]);
}

/// The algorithms, each with its state.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Algorithm {
    /// Genetic algorithm.
    Ga(Ga),
    /// Separable natural evolution strategy.
    Snes(Snes),
    /// Exponential natural evolution strategy.
    Xnes(Xnes),
    /// Covariance matrix adaptation.
    CmaEs(CmaEs),
    /// Covariance matrix adaptation with a diagonal matrix.
    SepCmaEs(SepCmaEs),
    /// OpenAI's evolution strategy.
    OpenAiEs(OpenAiEs),
}

/// Why an algorithm cannot evolve a population: a limit that depends on more
/// than one key of the configuration.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unsuitable {
    /// The segment is empty.
    #[error("the population has no genes: nothing that its `objects` name exists")]
    NoGenes,
    /// Nobody would be bred.
    #[error("must be below population_size ({population_size}), is {n_elite}")]
    OnlyElite {
        /// `num_elite`.
        n_elite: usize,
        /// P.
        population_size: usize,
    },
    /// There is nothing to compare.
    #[error("this algorithm compares individuals: at least 2 are needed")]
    TooFewIndividuals,
    /// A matrix of this size costs too much.
    #[error(
        "a population of {d} genes is too large for this algorithm, whose cost grows with the cube \
         of the genes (at most {FULL_MATRIX_GENES_MAX}); use \"sep-CMA-ES\" or \"SNES\""
    )]
    TooManyGenes {
        /// Genes of the population.
        d: usize,
    },
}

impl Algorithm {
    /// An algorithm at its start. `d`: genes of the population.
    pub fn new(
        name: AlgorithmName,
        params: &AlgorithmParams,
        d: usize,
        population_size: usize,
    ) -> Result<Self, Unsuitable> {
        if d == 0 {
            return Err(Unsuitable::NoGenes);
        }
        let compares = matches!(params, AlgorithmParams::CmaEs(_) | AlgorithmParams::OpenAiEs(_));
        if compares && population_size < 2 {
            return Err(Unsuitable::TooFewIndividuals);
        }
        let has_full_matrix = matches!(name, AlgorithmName::Xnes | AlgorithmName::CmaEs);
        if has_full_matrix && d > FULL_MATRIX_GENES_MAX {
            return Err(Unsuitable::TooManyGenes { d });
        }
        Ok(match params {
            AlgorithmParams::Ga(params) => Self::Ga(Ga::new(params, d, population_size)?),
            AlgorithmParams::Snes(params) => Self::Snes(Snes::new(params, d)),
            AlgorithmParams::Xnes(params) => Self::Xnes(Xnes::new(params, d)),
            AlgorithmParams::CmaEs(params) if name == AlgorithmName::SepCmaEs => {
                Self::SepCmaEs(SepCmaEs::new(params, d))
            }
            AlgorithmParams::CmaEs(params) => Self::CmaEs(CmaEs::new(params, d)),
            AlgorithmParams::OpenAiEs(params) => Self::OpenAiEs(OpenAiEs::new(params, d)),
        })
    }

    /// The mean of its distribution as a genotype, if it has one.
    pub fn mean(&self) -> Option<Genotype> {
        let mean = self.strategy().mean()?;
        Some(mean.iter().map(|&gene| mirror(gene)).collect())
    }

    fn strategy(&self) -> &dyn Strategy {
        match self {
            Self::Ga(ga) => ga,
            Self::Snes(snes) => snes,
            Self::Xnes(xnes) => xnes,
            Self::CmaEs(cma_es) => cma_es,
            Self::SepCmaEs(sep_cma_es) => sep_cma_es,
            Self::OpenAiEs(openai_es) => openai_es,
        }
    }

    fn strategy_mut(&mut self) -> &mut dyn Strategy {
        match self {
            Self::Ga(ga) => ga,
            Self::Snes(snes) => snes,
            Self::Xnes(xnes) => xnes,
            Self::CmaEs(cma_es) => cma_es,
            Self::SepCmaEs(sep_cma_es) => sep_cma_es,
            Self::OpenAiEs(openai_es) => openai_es,
        }
    }
}

impl Strategy for Algorithm {
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        self.strategy().sample(population_size, rng)
    }

    fn learn(&mut self, sample: &Sample, ranking: &[usize], fitness: &[f64]) {
        self.strategy_mut().learn(sample, ranking, fitness);
    }
}

/// `n` vectors of `d` independent standard normals, in this order.
fn draw_normals(n: usize, d: usize, rng: &mut Stream) -> Vec<Vec<f64>> {
    let vector = || {
        let mut vector = vec![0.0; d];
        rng.fill_normal(&mut vector);
        vector
    };
    iter::repeat_with(vector).take(n).collect()
}

/// `x` in \[0, 1\], by reflection at both ends.
fn mirror(x: f64) -> f64 {
    let x = x.abs();
    let x = x - 2.0 * (x / 2.0).floor();
    if x > 1.0 { 2.0 - x } else { x }
}

/// e^x, but finite: an update with a learning rate beyond reason must not make
/// NaN of 0 * infinity.
fn finite_exp(x: f64) -> f64 {
    libm::exp(x).min(f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::mirror;

    #[test]
    fn mirroring_reflects_at_both_ends_as_often_as_needed() {
        for (x, expected) in [
            (0.0, 0.0),
            (0.25, 0.25),
            (1.0, 1.0),
            (1.25, 0.75),
            (-0.25, 0.25),
            (2.25, 0.25),
            (-1.25, 0.75),
            (1001.25, 0.75),
        ] {
            assert_eq!(mirror(x), expected, "{x}");
        }
        for x in [1e300, -1e300, 1.0f64.next_up(), 0.0f64.next_down()] {
            assert!((0.0..=1.0).contains(&mirror(x)), "{x}");
        }
    }
}

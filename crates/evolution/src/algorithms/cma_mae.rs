//! CMA-MAE: distributions climb over thresholds that rise slowly wherever they have been.
//!
//! Fontaine, Nikolaidis: "Covariance matrix adaptation MAP-annealing", GECCO 2023. The paper's
//! archive decides by one evaluation who is in a cell. Here its thresholds guide the search, and
//! the elites are kept as MAP-Elites keeps them, by the evidence of all their trials. Diagonal
//! covariances: Tjanaka, Fontaine, Lee, Kalkar, Nikolaidis: "Training diverse high-dimensional
//! controllers by scaling covariance matrix adaptation MAP-annealing", IEEE RA-L 8(10), 2023.

use std::ops::Range;

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, DEPTH, Keeps, LearnsFrom, Parameter, Params, limits};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::{
    Draws, Sample, Strategy,
    cma_es::CmaEs,
    map_elites::MapElites,
    parameters::{MU_INIT, SIGMA_INIT},
    repertoire::{Axis, Behaviours, Elite, REEVALUATED, Repertoire},
    sep_cma_es::SepCmaEs,
    stopping::{CONDITION_MAX, DEVIATION_MIN, RANGE_OF_BEST_MIN},
};
use crate::{Birth, Evaluations, ranking::ranking};

/// Emitters with full covariances.
pub type CmaMae = CmaEs;
/// Emitters with diagonal covariances.
pub type SepCmaMae = SepCmaEs;

const EMITTERS: Parameter = Parameter::whole(
    "emitters",
    [1, limits::EMITTERS],
    5,
    "Number of distributions that share the new individuals of a generation equally",
);
const ARCHIVE_RATE: Parameter = Parameter::unit(
    "archive_rate",
    0.01,
    "Rate alpha at which the threshold of a cell follows the fitness that exceeds it. 0: the \
     thresholds stay, as in CMA-ES. 1: only what is better than all before counts",
);
const THRESHOLD_MIN: Parameter = Parameter::quantity(
    "threshold_min",
    0.0,
    "First threshold of every cell: the least fitness that is worth a place",
);

/// A distribution of an algorithm of this kind.
pub trait Emitter: Strategy + Sized {
    /// Name, parameters and limits of the algorithm.
    const DESCRIPTION: AlgorithmDescription;

    /// Whether its state is a matrix.
    const IS_MATRIX: bool;

    /// A first distribution.
    fn from_mean(mean: Vec<f64>, sigma: f64) -> Self;

    /// Draws `n` individuals.
    fn draw(&self, n: usize, rng: &mut Stream) -> Draws;
}

const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
    name: "CMA-MAE",
    title: "Covariance matrix adaptation MAP-annealing",
    learns: "elites and threshold of each cell, distributions",
    state: "elites d + emitters d²/2",
    keeps: Keeps::Repertoire,
    individuals_min: 4,
    learns_from: LearnsFrom::Descriptors,
    genes_max: Some(limits::GENES_OF_FULL_MATRICES),
    parameters: &[REEVALUATED, DEPTH, MU_INIT, SIGMA_INIT, EMITTERS, ARCHIVE_RATE, THRESHOLD_MIN],
};

impl Emitter for CmaMae {
    const DESCRIPTION: AlgorithmDescription = DESCRIPTION;
    const IS_MATRIX: bool = true;

    fn from_mean(mean: Vec<f64>, sigma: f64) -> Self {
        Self::from_mean(mean, sigma)
    }

    fn draw(&self, n: usize, rng: &mut Stream) -> Draws {
        self.draw(n, rng)
    }
}

impl Emitter for SepCmaMae {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "sep-CMA-MAE",
        title: "CMA-MAE with diagonal covariances",
        state: "elites d + 4 emitters d",
        genes_max: None,
        ..DESCRIPTION
    };
    const IS_MATRIX: bool = false;

    fn from_mean(mean: Vec<f64>, sigma: f64) -> Self {
        Self::from_mean(mean, sigma)
    }

    fn draw(&self, n: usize, rng: &mut Stream) -> Draws {
        self.draw(n, rng)
    }
}

/// Thresholds, emitters and elites between two generations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Annealing<E> {
    /// Its elites. Its own variation draws nothing.
    elites: Repertoire<MapElites>,
    archive_rate: f64,
    sigma_init: f64,
    /// Fitness that an individual of each cell has to exceed.
    thresholds: Vec<f64>,
    emitters: Vec<E>,
}

impl<E: Emitter> Annealing<E> {
    /// See [`Emitter::DESCRIPTION`].
    pub const DESCRIPTION: AlgorithmDescription = <E as Emitter>::DESCRIPTION;

    /// An empty repertoire, over `d` genes and the grid of these axes.
    pub fn start(params: &Params, d: usize, axes: &[Axis]) -> Self {
        let n_cells = axes.iter().map(|axis| axis.n_cells as usize).product();
        let n_emitters: u32 = params.value_of(&EMITTERS);
        let sigma_init = params.value_of(&SIGMA_INIT);
        let emitter = |_| E::from_mean(vec![params.value_of(&MU_INIT); d], sigma_init);
        Self {
            elites: Repertoire::start(params, d, axes),
            archive_rate: params.value_of(&ARCHIVE_RATE),
            sigma_init,
            thresholds: vec![params.value_of(&THRESHOLD_MIN); n_cells],
            emitters: (0..n_emitters).map(emitter).collect(),
        }
    }

    /// The individuals of each emitter after the first `n_again`. An emitter gets at least two, or
    /// nothing, except that the first one takes what there is.
    fn shares(&self, n_again: usize, population_size: usize) -> Vec<Range<usize>> {
        let n_new = population_size - n_again;
        let n_active = self.emitters.len().min(n_new / 2).max(1);
        let end = |nth: usize| n_again + nth * n_new / n_active;
        (0..n_active).map(|nth| end(nth)..end(nth + 1)).collect()
    }

    /// The cells of individuals and how much their fitness exceeds the thresholds there; `None`
    /// for those with a number that is not finite.
    fn improvements(&self, told: Evaluations<'_>) -> Vec<Option<(usize, f64)>> {
        let axes = self.elites.axes();
        let of_each = |(fitness, descriptors): (&Vec<f64>, &Vec<f64>)| {
            let mut individual = Elite::new(0, 0, axes.len());
            individual.add(fitness, descriptors);
            let evidence = individual.is_finite().then(|| individual.evidence(axes))?;
            Some((evidence.cell, evidence.fitness - self.thresholds.get(evidence.cell)?))
        };
        told.fitness.iter().zip(told.descriptors).map(of_each).collect()
    }

    /// Raises the thresholds to which improvements belong: with n of them in a cell, which are in
    /// the mean larger than the threshold by m, by m (1 - (1 - alpha)^n), whatever their order.
    fn raise(&mut self, improvements: &[Option<(usize, f64)>]) {
        let mut positive: Vec<(usize, f64)> =
            improvements.iter().flatten().filter(|(_, by)| *by > 0.0).copied().collect();
        // The sort is stable, so each sum has the order of the individuals.
        positive.sort_by_key(|(cell, _)| *cell);
        for of_cell in positive.chunk_by(|a, b| a.0 == b.0) {
            let n = of_cell.len() as f64;
            let mean = of_cell.iter().map(|(_, by)| by).sum::<f64>() / n;
            let share = 1.0 - libm::pow(1.0 - self.archive_rate, n);
            // 0 times a sum that overflows would be no number.
            if share == 0.0 {
                continue;
            }
            let raised = self.thresholds[of_cell[0].0] + share * mean;
            self.thresholds[of_cell[0].0] = raised.min(f64::MAX);
        }
    }

    /// Begins anew from an elite. `uniform`: the draw that chooses it.
    fn restarted(&self, emitter: &E, uniform: f64) -> E {
        let elites = self.elites.elites();
        let place = (uniform * elites.len() as f64) as usize;
        let mean = match elites.get(place) {
            Some(elite) => elite.genotype.clone(),
            None => emitter.mean().unwrap_or_default().to_vec(),
        };
        E::from_mean(mean, self.sigma_init)
    }
}

/// Whether an emitter has nothing more to find, by the package `ribs`: the values by which it
/// ranked individuals are alike, or its distribution has become too narrow or too flat.
fn is_over(emitter: &impl Strategy, best: f64, worst: f64) -> bool {
    let deviations = emitter.deviations().unwrap_or_default();
    let longest = deviations.iter().copied().fold(0.0, f64::max);
    let shortest = deviations.iter().copied().fold(f64::MAX, f64::min);
    let condition = (longest / shortest) * (longest / shortest);
    best - worst < RANGE_OF_BEST_MIN || longest < DEVIATION_MIN || condition > CONDITION_MAX
}

impl<E: Emitter + Serialize + DeserializeOwned> Behaviours for Annealing<E> {
    fn n_genes(&self) -> usize {
        self.elites.n_genes()
    }

    fn n_kept(&self) -> usize {
        self.elites.n_kept()
    }

    fn n_matrices(&self) -> usize {
        if E::IS_MATRIX { self.emitters.len() } else { 0 }
    }

    fn axes(&self) -> &[Axis] {
        self.elites.axes()
    }

    fn is_sound(&self) -> bool {
        let n_cells: u64 = self.elites.axes().iter().map(|axis| u64::from(axis.n_cells)).product();
        self.elites.is_sound()
            && self.thresholds.len() as u64 == n_cells
            && (1..=limits::EMITTERS as usize).contains(&self.emitters.len())
            && self.emitters.iter().all(|emitter| emitter.n_genes() == self.n_genes())
    }

    fn elites(&self) -> Vec<&Elite> {
        self.elites.elites()
    }

    /// Elites to evaluate again, individuals of each emitter, and a draw per emitter for its
    /// restart.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let mut all = Draws::default();
        all.genotypes.reserve_exact(population_size);
        let again = self.elites.evaluated_again(population_size);
        all.genotypes.extend(again.into_iter().map(|elite| elite.genotype.clone()));
        let shares = self.shares(all.genotypes.len(), population_size);
        for (emitter, share) in self.emitters.iter().zip(&shares) {
            let mut draws = emitter.draw(share.len(), rng);
            all.genotypes.append(&mut draws.genotypes);
            all.normals.resize(share.start, Vec::new());
            all.normals.append(&mut draws.normals);
            if !draws.steps.is_empty() {
                all.steps.resize(share.start, Vec::new());
                all.steps.append(&mut draws.steps);
            }
        }
        let uniforms = shares.iter().map(|_| rng.uniform()).collect();
        Sample { uniforms, ..all.into() }
    }

    /// Individuals of a distribution have no parents.
    fn births(&self, _population_size: usize, _rng: &mut Stream) -> Option<Vec<Birth>> {
        None
    }

    fn learn(&mut self, generation: u64, sample: &Sample, told: Evaluations<'_>) {
        let population_size = sample.genotypes.len();
        let n_again = self.elites.n_again(population_size);
        let improvements = self.improvements(told);
        self.raise(&improvements[n_again..]);
        self.elites.learn(generation, sample, told);
        let shares = self.shares(n_again, population_size);
        for (nth, share) in shares.into_iter().enumerate().filter(|(_, share)| share.len() > 1) {
            let values: Vec<f64> = improvements[share.clone()]
                .iter()
                .map(|improvement| improvement.map_or(f64::NAN, |(_, by)| by))
                .collect();
            let order = ranking(&values);
            let Some(&last) = order.iter().rfind(|&&i| values[i].is_finite()) else { continue };
            let individuals: Vec<usize> = order.iter().map(|i| share.start + i).collect();
            self.emitters[nth].learn(sample, &individuals, &values);
            if is_over(&self.emitters[nth], values[order[0]], values[last]) {
                self.emitters[nth] = self.restarted(&self.emitters[nth], sample.uniforms[nth]);
            }
        }
    }
}

#[cfg(test)]
mod tests;

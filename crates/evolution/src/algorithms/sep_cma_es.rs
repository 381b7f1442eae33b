//! Covariance matrix adaptation with a diagonal covariance: cost and state grow
//! with d instead of d^2.
//!
//! Ros, Hansen: "A simple modification in CMA-ES achieving linear time and space
//! complexity", PPSN X (2008).

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Params};
use serde::{Deserialize, Serialize};

use super::{
    Described, Draws, Sample, Strategy,
    cumulation::{Cumulation, Rates, VARIANCE_MAX, damping},
    draw_normal, draw_normals, mirror,
    parameters::{MU_INIT, SIGMA_INIT},
};
use crate::Genotype;

/// A Gaussian with mean m and covariance sigma^2 diag(C), of points in all of
/// R^d that are mirrored into genotypes, as in CMA-ES.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SepCmaEs {
    mean: Vec<f64>,
    /// Diagonal of C.
    variances: Vec<f64>,
    cumulation: Cumulation,
}

impl Described for SepCmaEs {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "sep-CMA-ES",
        title: "CMA-ES with a diagonal covariance",
        learns: "mean, step size, variance per gene",
        state: "4 d",
        keeps: Keeps::Vectors,
        individuals_min: 2,
        learns_from: LearnsFrom::Ranks,
        genes_max: None,
        parameters: &[MU_INIT, SIGMA_INIT],
    };

    fn start(params: &Params, d: usize) -> Self {
        Self::from_mean(vec![params.value_of(&MU_INIT); d], params.value_of(&SIGMA_INIT))
    }
}

impl SepCmaEs {
    /// A first distribution, with C = I.
    pub fn from_mean(mean: Vec<f64>, sigma: f64) -> Self {
        let d = mean.len();
        Self { mean, variances: vec![1.0; d], cumulation: Cumulation::new(sigma, d) }
    }

    /// x_i = m + sigma * C^(1/2) z_i, z_i ~ N(0, I).
    pub fn draw(&self, n: usize, rng: &mut Stream) -> Draws {
        let deviations = self.deviations();
        let normals = draw_normals(n, self.mean.len(), rng);
        let genotypes = normals.iter().map(|z| self.genotype(&deviations, z)).collect();
        Draws { genotypes, normals, steps: Vec::new() }
    }

    /// sigma * C^(1/2).
    fn deviations(&self) -> Vec<f64> {
        self.variances.iter().map(|c| self.cumulation.sigma * c.sqrt()).collect()
    }

    fn genotype(&self, deviations: &[f64], z: &[f64]) -> Genotype {
        let genes = self.mean.iter().zip(deviations).zip(z);
        genes.map(|((mean, deviation), z)| mirror(mean + deviation * z)).collect()
    }
}

impl Strategy for SepCmaEs {
    fn n_genes(&self) -> usize {
        self.mean.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        let sigma = self.cumulation.sigma;
        Some(self.variances.iter().map(|variance| sigma * variance.sqrt()).collect())
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mean)
    }

    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        self.draw(population_size, rng).into()
    }

    fn draws_one_by_one(&self) -> bool {
        true
    }

    fn individual(&self, index: usize, _: usize, rng: &mut Stream) -> Option<Genotype> {
        Some(self.genotype(&self.deviations(), &draw_normal(index, self.mean.len(), rng)))
    }

    /// As CMA-ES (Eq. 41 to 47 of its tutorial), but only the better half are parents, and C is
    /// diagonal: y = C^(1/2) z.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mean.len();
        let (weights, rates) = weights_and_rates(d, ranking.len());
        let mut z_mean = vec![0.0; d];
        let mut z_squared_mean = vec![0.0; d];
        for (&i, weight) in ranking.iter().zip(&weights) {
            for (j, z) in sample.normals[i].iter().enumerate() {
                z_mean[j] += weight * z;
                z_squared_mean[j] += weight * z * z;
            }
        }
        let y_mean: Vec<f64> =
            z_mean.iter().zip(&self.variances).map(|(z, c)| z * c.sqrt()).collect();
        for (mean, y) in self.mean.iter_mut().zip(&y_mean) {
            *mean += self.cumulation.sigma * y;
        }
        let delta_h_sigma = self.cumulation.update(&rates, &y_mean, &z_mean);
        let keep = 1.0 + rates.c_1 * delta_h_sigma - rates.c_1 - rates.c_mu;
        let variance_min = self.cumulation.variance_min();
        for (j, c) in self.variances.iter_mut().enumerate() {
            let rank_one = rates.c_1 * self.cumulation.p_c[j] * self.cumulation.p_c[j];
            let rank_mu = rates.c_mu * z_squared_mean[j] * *c;
            *c = (keep * *c + rank_one + rank_mu).clamp(variance_min, VARIANCE_MAX);
        }
    }
}

#[cfg(test)]
impl SepCmaEs {
    /// A sample of given points x.
    pub fn sample_of(&self, points: &[Vec<f64>]) -> Sample {
        let sigma = self.cumulation.sigma;
        let normal = |((x, m), c): ((&f64, &f64), &f64)| (x - m) / (sigma * c.sqrt());
        let normals = points
            .iter()
            .map(|point| point.iter().zip(&self.mean).zip(&self.variances).map(normal).collect());
        Sample::new(Vec::new(), normals.collect())
    }
}

/// Weights of the parents, best first, and learning rates: the paper's Table 1
/// with mu_cov = mu_eff. c_cov is (d + 2)/3 times that of the full matrix, and at
/// most 1, which the paper's small populations never reach.
fn weights_and_rates(d: usize, lambda: usize) -> (Vec<f64>, Rates) {
    let d = d as f64;
    let mu = lambda / 2;
    let raw = |rank: usize| libm::log(mu as f64 + 1.0) - libm::log(rank as f64);
    let mut weights: Vec<f64> = (1..=mu).map(raw).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();

    let root = d + std::f64::consts::SQRT_2;
    let rank_one = 2.0 / (root * root);
    let rank_mu = ((2.0 * mu_eff - 1.0) / ((d + 2.0) * (d + 2.0) + mu_eff)).min(1.0);
    let c_full = rank_one / mu_eff + (1.0 - 1.0 / mu_eff) * rank_mu;
    let c_cov = ((d + 2.0) / 3.0 * c_full).min(1.0);
    let c_sigma = (mu_eff + 2.0) / (d + mu_eff + 3.0);
    let rates = Rates {
        mu_eff,
        c_sigma,
        d_sigma: damping(d, mu_eff, c_sigma),
        c_c: 4.0 / (d + 4.0),
        c_1: c_cov / mu_eff,
        c_mu: c_cov * (1.0 - 1.0 / mu_eff),
    };
    (weights, rates)
}

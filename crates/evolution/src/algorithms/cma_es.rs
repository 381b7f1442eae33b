//! Covariance matrix adaptation evolution strategy, with cumulation, rank-one
//! and rank-mu updates and negative weights.
//!
//! Hansen: "The CMA evolution strategy: a tutorial", arXiv 1604.00772 (2016, revised 2023);
//! equation numbers refer to this paper.

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Params, limits};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{
    Described, Draws, Sample, Strategy,
    cumulation::{Cumulation, Rates, VARIANCE_MAX, damping},
    draw_normals,
    linalg::{Eigen, Symmetric},
    mirror,
    parameters::{MU_INIT, SIGMA_INIT},
    restarts::RESTARTS,
};

/// A Gaussian with mean m and covariance sigma^2 C, of points x in all of R^d.
///
/// Bounds: a point x stands for the genotype into which it is mirrored, so the algorithm
/// maximises a function on R^d without bounds. (Learning from clipped points would make C lose
/// the clipped directions, and the search would end on a face of the cube, away from the
/// optimum.)
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    mean: Vec<f64>,
    covariance: Symmetric,
    cumulation: Cumulation,
}

/// Smallest eigenvalue of C, relative to the largest; smaller ones would vanish in rounding.
const EIGENVALUE_RATIO_MIN: f64 = 1e-14;

impl Described for CmaEs {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "CMA-ES",
        title: "Covariance matrix adaptation evolution strategy",
        learns: "mean, step size, covariance",
        state: "d²/2",
        keeps: Keeps::Matrix,
        individuals_min: 2,
        learns_from: LearnsFrom::Ranks,
        genes_max: Some(limits::GENES_OF_FULL_MATRIX),
        parameters: &[MU_INIT, SIGMA_INIT, RESTARTS],
    };

    fn start(params: &Params, d: usize) -> Self {
        Self::from_mean(vec![params.value_of(&MU_INIT); d], params.value_of(&SIGMA_INIT))
    }
}

impl CmaEs {
    /// A first distribution, with C = I.
    pub fn from_mean(mean: Vec<f64>, sigma: f64) -> Self {
        let d = mean.len();
        Self { mean, covariance: Symmetric::identity(d), cumulation: Cumulation::new(sigma, d) }
    }

    /// x_i = m + sigma * y_i, y_i = C^(1/2) z_i, z_i ~ N(0, I). With the symmetric
    /// root, z_i is also C^(-1/2) y_i, so learning needs no root.
    pub fn draw(&self, n: usize, rng: &mut Stream) -> Draws {
        let normals = draw_normals(n, self.mean.len(), rng);
        let steps = self.steps(&normals);
        let sigma = self.cumulation.sigma;
        let genotypes = steps
            .iter()
            .map(|y| self.mean.iter().zip(y).map(|(mean, y)| mirror(mean + sigma * y)).collect())
            .collect();
        Draws { genotypes, normals, steps }
    }

    /// The decomposition of C.
    pub fn eigen(&self) -> Eigen {
        Eigen::new(&self.covariance.to_dense())
    }

    /// The steps y_i = C^(1/2) z_i of these normals z_i.
    pub fn steps(&self, normals: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let (eigen, deviations) = self.root();
        let colour = |z: &Vec<f64>| eigen.apply(&deviations, &DVector::from_column_slice(z));
        normals.iter().map(|z| colour(z).as_slice().to_vec()).collect()
    }

    /// Whether the standard deviations of all genes, and the path of C in units of sigma, are
    /// below `limit`.
    pub fn is_narrower_than(&self, limit: f64) -> bool {
        let sigma = self.cumulation.sigma;
        let is_short = self.cumulation.p_c.iter().all(|p| sigma * p.abs() < limit);
        is_short && self.deviations().is_some_and(|of_each| of_each.iter().all(|s| *s < limit))
    }

    /// Eigenvectors of C and the square roots of its eigenvalues.
    fn root(&self) -> (Eigen, DVector<f64>) {
        let eigen = self.eigen();
        let min = EIGENVALUE_RATIO_MIN * eigen.values.max();
        let deviations = eigen.values.map(|value| value.max(min).sqrt());
        (eigen, deviations)
    }
}

impl Strategy for CmaEs {
    fn n_genes(&self) -> usize {
        self.mean.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        let sigma = self.cumulation.sigma;
        let covariance = self.covariance.to_dense();
        Some(covariance.diagonal().iter().map(|variance| sigma * variance.sqrt()).collect())
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mean)
    }

    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        self.draw(population_size, rng).into()
    }

    /// Eq. 41 to 47.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mean.len();
        let (weights, rates) = weights_and_rates(d, ranking.len());
        let mut y_mean = vec![0.0; d];
        let mut z_mean = vec![0.0; d];
        for (&i, &weight) in ranking.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0) {
            for j in 0..d {
                y_mean[j] += weight * sample.steps[i][j];
                z_mean[j] += weight * sample.normals[i][j];
            }
        }
        for (mean, y) in self.mean.iter_mut().zip(&y_mean) {
            *mean += self.cumulation.sigma * y;
        }
        let delta_h_sigma = self.cumulation.update(&rates, &y_mean, &z_mean);

        let sum_of_weights: f64 = weights.iter().sum();
        let keep = 1.0 + rates.c_1 * delta_h_sigma - rates.c_1 - rates.c_mu * sum_of_weights;
        let covariance_before = self.covariance.clone();
        self.covariance.scale(keep);
        self.covariance.add_outer(rates.c_1, &self.cumulation.p_c);
        for (&i, &weight) in ranking.iter().zip(&weights) {
            let weight = if weight < 0.0 {
                let z = &sample.normals[i];
                weight * d as f64 / z.iter().map(|z| z * z).sum::<f64>()
            } else {
                weight
            };
            self.covariance.add_outer(rates.c_mu * weight, &sample.steps[i]);
        }
        self.covariance.raise_diagonal(self.cumulation.variance_min());
        if !self.covariance.is_within(VARIANCE_MAX) {
            self.covariance = covariance_before;
        }
    }
}

#[cfg(test)]
impl CmaEs {
    /// A sample of given points x.
    pub fn sample_of(&self, points: &[Vec<f64>]) -> Sample {
        let (eigen, deviations) = self.root();
        let sigma = self.cumulation.sigma;
        let step = |x: &Vec<f64>| x.iter().zip(&self.mean).map(|(x, m)| (x - m) / sigma).collect();
        let steps: Vec<Vec<f64>> = points.iter().map(step).collect();
        let inverse = deviations.map(|deviation| 1.0 / deviation);
        let whiten = |y: &Vec<f64>| eigen.apply(&inverse, &DVector::from_column_slice(y));
        let normals = steps.iter().map(|y| whiten(y).as_slice().to_vec()).collect();
        Sample { steps, ..Sample::new(Vec::new(), normals) }
    }
}

/// Weights by rank, best first, and learning rates: the tutorial's Table 1
/// (Eq. 49 to 58), alpha_cov = 2.
fn weights_and_rates(d: usize, lambda: usize) -> (Vec<f64>, Rates) {
    let d = d as f64;
    let raw = |rank: usize| libm::log((lambda as f64 + 1.0) / 2.0) - libm::log(rank as f64);
    let mut weights: Vec<f64> = (1..=lambda).map(raw).collect();
    let effective = |weights: &[f64]| {
        let sum: f64 = weights.iter().sum();
        sum * sum / weights.iter().map(|w| w * w).sum::<f64>()
    };
    let mu = lambda / 2;
    let mu_eff = effective(&weights[..mu]);
    let mu_eff_minus = effective(&weights[mu..]);

    let c_1 = 2.0 / ((d + 1.3) * (d + 1.3) + mu_eff);
    let c_mu = 2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((d + 2.0) * (d + 2.0) + mu_eff);
    let c_mu = c_mu.min(1.0 - c_1);
    let c_sigma = (mu_eff + 2.0) / (d + mu_eff + 5.0);
    let rates = Rates {
        mu_eff,
        c_sigma,
        d_sigma: damping(d, mu_eff, c_sigma),
        c_c: (4.0 + mu_eff / d) / (d + 4.0 + 2.0 * mu_eff / d),
        c_1,
        c_mu,
    };

    let alpha_mu = 1.0 + c_1 / c_mu;
    let alpha_mu_eff = 1.0 + 2.0 * mu_eff_minus / (mu_eff + 2.0);
    let alpha_pos_def = (1.0 - c_1 - c_mu) / (d * c_mu);
    let alpha = alpha_mu.min(alpha_mu_eff).min(alpha_pos_def);
    let positive_sum: f64 = weights.iter().filter(|w| **w > 0.0).sum();
    let negative_sum: f64 = weights.iter().filter(|w| **w < 0.0).sum();
    for weight in &mut weights {
        *weight =
            if *weight >= 0.0 { *weight / positive_sum } else { -alpha * *weight / negative_sum };
    }
    (weights, rates)
}

//! Covariance matrix adaptation evolution strategy, with cumulation, rank-one
//! and rank-mu updates and negative weights.
//!
//! Hansen: "The CMA evolution strategy: a tutorial", arXiv 1604.00772 (2016,
//! revised 2023); equation numbers are its own. Bounds after Hansen: "Injecting
//! external solutions into CMA-ES", arXiv 1110.4181.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use sim_core::{config::CmaEsParams, random::Stream};

use super::{
    Sample, Strategy,
    cumulation::{Cumulation, Rates, damping},
    draw_normals,
    linalg::{Eigen, Symmetric},
};

/// A Gaussian with mean m, within \[0, 1\], and covariance sigma^2 C.
///
/// Bounds: an individual is evaluated at the point of the cube nearest to what
/// was drawn, and the update learns from that same point, so the mean never
/// leaves the cube. Where C is ill-conditioned such a point can be improbably far
/// from the mean, measured by C; the update then learns from the point on the way
/// to it at the distance sqrt(d) + 2d/(d + 2), the rule for points from elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CmaEs {
    mean: Vec<f64>,
    covariance: Symmetric,
    cumulation: Cumulation,
}

/// Smallest eigenvalue of C, relative to the largest, that sampling tells from
/// rounding.
const EIGENVALUE_RATIO_MIN: f64 = 1e-14;

/// C^(1/2) and C^(-1/2).
struct Roots {
    eigen: Eigen,
    deviations: DVector<f64>,
    inverse_deviations: DVector<f64>,
}

impl CmaEs {
    /// The first distribution over `d` genes, with C = I.
    pub fn new(params: &CmaEsParams, d: usize) -> Self {
        Self {
            mean: vec![params.mu_init; d],
            covariance: Symmetric::identity(d),
            cumulation: Cumulation::new(params.sigma_init, d),
        }
    }

    fn roots(&self) -> Roots {
        let eigen = Eigen::of(&self.covariance.to_dense());
        let min = EIGENVALUE_RATIO_MIN * eigen.values.max();
        let deviations = eigen.values.map(|value| value.max(min).sqrt());
        let inverse_deviations = deviations.map(|deviation| 1.0 / deviation);
        Roots { eigen, deviations, inverse_deviations }
    }

    /// (g - m) / sigma
    fn step(&self, genotype: &[f64]) -> Vec<f64> {
        let sigma = self.cumulation.sigma;
        genotype.iter().zip(&self.mean).map(|(gene, mean)| (gene - mean) / sigma).collect()
    }
}

impl Roots {
    /// C^(1/2) `z`
    fn colour(&self, z: &[f64]) -> DVector<f64> {
        self.eigen.apply(&self.deviations, &DVector::from_column_slice(z))
    }

    /// C^(-1/2) `y`
    fn whiten(&self, y: &[f64]) -> Vec<f64> {
        let z = self.eigen.apply(&self.inverse_deviations, &DVector::from_column_slice(y));
        z.as_slice().to_vec()
    }
}

impl Strategy for CmaEs {
    /// g_i = clip(m + sigma * C^(1/2) z_i), z_i ~ N(0, I). The normals of a
    /// clipped individual are C^(-1/2) (g_i - m) / sigma, those it would have been
    /// drawn from.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let roots = self.roots();
        let mut normals = draw_normals(population_size, self.mean.len(), rng);
        let mut genotypes = Vec::with_capacity(population_size);
        for z in &mut normals {
            let y = roots.colour(z);
            let point = self.mean.iter().zip(&y).map(|(mean, y)| mean + self.cumulation.sigma * y);
            let mut genotype: Vec<f64> = point.collect();
            if genotype.iter().any(|gene| !(0.0..=1.0).contains(gene)) {
                genotype.iter_mut().for_each(|gene| *gene = gene.clamp(0.0, 1.0));
                *z = roots.whiten(&self.step(&genotype));
            }
            genotypes.push(genotype);
        }
        Sample { genotypes, normals }
    }

    /// Eq. 41 to 47, with y_i = (g_i - m) / sigma and C^(-1/2) y_i from the
    /// sample.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mean.len();
        let (weights, rates) = weights_and_rates(d, ranking.len());
        let length_max = (d as f64).sqrt() + 2.0 * d as f64 / (d as f64 + 2.0);

        // Steps, best first, with their squared lengths measured by C.
        let mut steps = Vec::with_capacity(ranking.len());
        let mut y_mean = vec![0.0; d];
        let mut z_mean = vec![0.0; d];
        for (&i, &weight) in ranking.iter().zip(&weights) {
            let (genotype, z) = (&sample.genotypes[i], &sample.normals[i]);
            let length = z.iter().map(|z| z * z).sum::<f64>().sqrt();
            let is_on_bound = genotype.iter().any(|&gene| gene == 0.0 || gene == 1.0);
            let scale = if is_on_bound { (length_max / length).min(1.0) } else { 1.0 };
            let mut y = self.step(genotype);
            y.iter_mut().for_each(|y| *y *= scale);
            if weight > 0.0 {
                for j in 0..d {
                    y_mean[j] += weight * y[j];
                    z_mean[j] += weight * scale * z[j];
                }
            }
            steps.push((y, (scale * length) * (scale * length)));
        }

        for (mean, y) in self.mean.iter_mut().zip(&y_mean) {
            *mean = (*mean + self.cumulation.sigma * y).clamp(0.0, 1.0);
        }
        let delta_h_sigma = self.cumulation.update(&rates, &y_mean, &z_mean);

        let sum_of_weights: f64 = weights.iter().sum();
        let keep = 1.0 + rates.c_1 * delta_h_sigma - rates.c_1 - rates.c_mu * sum_of_weights;
        self.covariance.scale(keep);
        self.covariance.add_outer(rates.c_1, &self.cumulation.p_c);
        for (&weight, (y, length_squared)) in weights.iter().zip(&steps) {
            let weight = if weight >= 0.0 {
                weight
            } else if *length_squared > 0.0 {
                weight * d as f64 / length_squared
            } else {
                0.0
            };
            self.covariance.add_outer(rates.c_mu * weight, y);
        }
        self.covariance.raise_diagonal(self.cumulation.variance_min());
    }
}

#[cfg(test)]
impl CmaEs {
    /// A sample of given individuals.
    pub fn sample_of(&self, genotypes: Vec<Vec<f64>>) -> Sample {
        let roots = self.roots();
        let normals = genotypes.iter().map(|g| roots.whiten(&self.step(g))).collect();
        Sample { genotypes, normals }
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

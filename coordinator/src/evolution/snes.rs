//! Separable natural evolution strategy.
//!
//! Schaul, Glasmachers, Schmidhuber: "High dimensions and heavy tails for
//! natural evolution strategies", GECCO 2011; Wierstra et al.: "Natural
//! evolution strategies", JMLR 15 (2014); the thesis's Algorithm 3.

use serde::{Deserialize, Serialize};
use sim_core::{config::SnesParams, random::Stream};

use super::{Sample, ranking::utilities};

/// A Gaussian with a diagonal covariance, per gene: mean mu and standard
/// deviation sigma, both kept in \[0, 1\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snes {
    mu: Vec<f64>,
    sigma: Vec<f64>,
    eta_mu: f64,
    eta_sigma: f64,
}

impl Snes {
    /// The first distribution over `d` genes.
    pub fn new(params: &SnesParams, d: usize) -> Self {
        let default_eta_sigma = (3.0 + libm::log(d as f64)) / (5.0 * (d as f64).sqrt());
        Self {
            mu: vec![params.mu_init; d],
            sigma: vec![params.sigma_init; d],
            eta_mu: params.eta_mu,
            eta_sigma: params.eta_sigma.unwrap_or(default_eta_sigma),
        }
    }

    /// g_i = clip(mu + sigma * s_i), s_i ~ N(0, I).
    pub fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let d = self.mu.len();
        let normals: Vec<Vec<f64>> =
            (0..population_size).map(|_| (0..d).map(|_| rng.normal()).collect()).collect();
        let genotypes = normals
            .iter()
            .map(|s| (0..d).map(|j| (self.mu[j] + self.sigma[j] * s[j]).clamp(0.0, 1.0)).collect())
            .collect();
        Sample { genotypes, normals }
    }

    /// mu += eta_mu * sigma * sum_i u_i s_i;
    /// sigma *= exp(eta_sigma / 2 * sum_i u_i (s_i^2 - 1)).
    /// The draws enter as they were, not as clipping left them.
    pub fn learn(&mut self, sample: &Sample, ranking: &[usize]) {
        let mut utility_of = vec![0.0; ranking.len()];
        for (&individual, utility) in ranking.iter().zip(utilities(ranking.len())) {
            utility_of[individual] = utility;
        }
        for j in 0..self.mu.len() {
            let mut gradient_mu = 0.0;
            let mut gradient_sigma = 0.0;
            for (utility, s) in utility_of.iter().zip(&sample.normals) {
                gradient_mu += utility * s[j];
                gradient_sigma += utility * (s[j] * s[j] - 1.0);
            }
            let step = self.eta_mu * self.sigma[j] * gradient_mu;
            self.mu[j] = (self.mu[j] + step).clamp(0.0, 1.0);
            let factor = libm::exp(self.eta_sigma / 2.0 * gradient_sigma);
            self.sigma[j] = (self.sigma[j] * factor).clamp(0.0, 1.0);
        }
    }
}

#[cfg(test)]
impl Snes {
    /// Mean and standard deviation per gene.
    pub fn distribution(&self) -> (&[f64], &[f64]) {
        (&self.mu, &self.sigma)
    }

    /// Replaces the distribution.
    pub fn set_distribution(&mut self, mu: &[f64], sigma: &[f64]) {
        self.mu = mu.to_vec();
        self.sigma = sigma.to_vec();
    }
}

//! Separable natural evolution strategy.
//!
//! Schaul, Glasmachers, Schmidhuber: "High dimensions and heavy tails for
//! natural evolution strategies", GECCO 2011; Wierstra et al.: "Natural
//! evolution strategies", JMLR 15 (2014); the thesis's Algorithm 3.

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::{
    Described, Sample, Strategy, draw_normal, draw_normals, finite_exp,
    parameters::{ETA_MU, MU_INIT, SIGMA_INIT},
};
use crate::{Genotype, ranking::utility_per_individual};

/// A Gaussian with a diagonal covariance, per gene: mean mu and standard
/// deviation sigma, both kept in \[0, 1\] (section 3.4.3).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snes {
    mu: Vec<f64>,
    sigma: Vec<f64>,
    eta_mu: f64,
    eta_sigma: f64,
}

const ETA_SIGMA: Parameter = Parameter::computed(
    "eta_sigma",
    "(3 + ln d)/(5 sqrt d)",
    "Learning rate of the deviations sigma",
);

impl Described for Snes {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "SNES",
        title: "Separable natural evolution strategy",
        learns: "mean, deviation per gene",
        state: "2 d",
        keeps: Keeps::Vectors,
        individuals_min: 1,
        learns_from: LearnsFrom::Ranks,
        genes_max: None,
        parameters: &[ETA_MU, ETA_SIGMA, MU_INIT, SIGMA_INIT],
    };

    fn start(params: &Params, d: usize) -> Self {
        let default_eta_sigma = (3.0 + libm::log(d as f64)) / (5.0 * (d as f64).sqrt());
        Self {
            mu: vec![params.value_of(&MU_INIT); d],
            sigma: vec![params.value_of(&SIGMA_INIT); d],
            eta_mu: params.value_of(&ETA_MU),
            eta_sigma: params.value_of::<Option<f64>>(&ETA_SIGMA).unwrap_or(default_eta_sigma),
        }
    }
}

impl Snes {
    fn genotype(&self, s: &[f64]) -> Genotype {
        let genes = self.mu.iter().zip(&self.sigma).zip(s);
        genes.map(|((mu, sigma), s)| (mu + sigma * s).clamp(0.0, 1.0)).collect()
    }
}

impl Strategy for Snes {
    fn n_genes(&self) -> usize {
        self.mu.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        Some(self.sigma.clone())
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mu)
    }

    /// g_i = clip(mu + sigma * s_i), s_i ~ N(0, I).
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let normals = draw_normals(population_size, self.mu.len(), rng);
        let genotypes = normals.iter().map(|s| self.genotype(s)).collect();
        Sample::new(genotypes, normals)
    }

    fn draws_one_by_one(&self) -> bool {
        true
    }

    fn individual(&self, index: usize, _: usize, rng: &mut Stream) -> Option<Genotype> {
        Some(self.genotype(&draw_normal(index, self.mu.len(), rng)))
    }

    /// mu += eta_mu * sigma * sum_i u_i s_i; sigma *= exp(eta_sigma / 2 * sum_i u_i (s_i^2 - 1)).
    /// The draws enter without clipping.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mu.len();
        let mut gradient_mu = vec![0.0; d];
        let mut gradient_sigma = vec![0.0; d];
        for (utility, s) in utility_per_individual(ranking).iter().zip(&sample.normals) {
            for j in 0..d {
                gradient_mu[j] += utility * s[j];
                gradient_sigma[j] += utility * (s[j] * s[j] - 1.0);
            }
        }
        for j in 0..d {
            let step = self.eta_mu * self.sigma[j] * gradient_mu[j];
            self.mu[j] = (self.mu[j] + step).clamp(0.0, 1.0);
            let factor = finite_exp(self.eta_sigma / 2.0 * gradient_sigma[j]);
            self.sigma[j] = (self.sigma[j] * factor).clamp(0.0, 1.0);
        }
    }
}

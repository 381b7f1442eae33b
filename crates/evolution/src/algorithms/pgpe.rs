//! Policy gradients with parameter-based exploration, with the optimiser ClipUp.
//!
//! Toklu, Liskowski, Srivastava: "ClipUp: a simple and powerful optimizer for
//! distribution-based policy evolution", PPSN XVI (2020); Sehnke et al.: "Parameter-exploring
//! policy gradients", Neural Networks 23 (2010): mirrored perturbations, centred ranks, a step of
//! bounded length for the mean, a step of bounded share for the deviations.

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::{
    Described, Sample, Strategy,
    cumulation::DEVIATION_MIN,
    pairs::{centred_ranks, draw_of_pairs, draw_pairs},
    parameters::{MU_INIT, SIGMA_INIT},
};
use crate::Genotype;

/// A Gaussian with a diagonal covariance, per gene: mean mu, kept in \[0, 1\], and standard
/// deviation sigma, kept in \[[`DEVIATION_MIN`], 1\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Pgpe {
    mu: Vec<f64>,
    sigma: Vec<f64>,
    /// The latest step of the mean, before it was kept in \[0, 1\].
    velocity: Vec<f64>,
    max_speed: f64,
    step_size: f64,
    momentum: f64,
    eta_sigma: f64,
    sigma_max_change: f64,
}

/// The paper's first radius of the distribution, in steps of the largest length.
const RADIUS_IN_STEPS: f64 = 15.0;

const MAX_SPEED: Parameter = Parameter::computed(
    "max_speed",
    "`sigma_init` sqrt d / 15",
    "Longest step of the mean, as a Euclidean distance",
);
const STEP_SIZE: Parameter = Parameter::computed(
    "step_size",
    "`max_speed` / 2",
    "Length that a gradient, whatever its own length, adds to the step",
);
const MOMENTUM: Parameter =
    Parameter::unit("momentum", 0.9, "Share of the previous step that continues");
const ETA_SIGMA: Parameter =
    Parameter::positive("eta_sigma", 0.1, "Learning rate of the deviations sigma");
const SIGMA_MAX_CHANGE: Parameter = Parameter::unit(
    "sigma_max_change",
    0.2,
    "Largest change of a deviation per generation, as a share of its value",
);

impl Described for Pgpe {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "PGPE",
        title: "Parameter-exploring policy gradients with ClipUp",
        learns: "mean, deviation per gene",
        state: "3 d",
        keeps: Keeps::Vectors,
        individuals_min: 2,
        learns_from: LearnsFrom::Pairs,
        genes_max: None,
        parameters: &[
            MU_INIT,
            SIGMA_INIT,
            MAX_SPEED,
            STEP_SIZE,
            MOMENTUM,
            ETA_SIGMA,
            SIGMA_MAX_CHANGE,
        ],
    };

    fn start(params: &Params, d: usize) -> Self {
        let sigma_init: f64 = params.value_of(&SIGMA_INIT);
        let default_speed = sigma_init * (d as f64).sqrt() / RADIUS_IN_STEPS;
        let max_speed = params.value_of::<Option<f64>>(&MAX_SPEED).unwrap_or(default_speed);
        let step_size = params.value_of::<Option<f64>>(&STEP_SIZE);
        Self {
            mu: vec![params.value_of(&MU_INIT); d],
            sigma: vec![sigma_init; d],
            velocity: vec![0.0; d],
            max_speed,
            step_size: step_size.unwrap_or(max_speed / 2.0),
            momentum: params.value_of(&MOMENTUM),
            eta_sigma: params.value_of(&ETA_SIGMA),
            sigma_max_change: params.value_of(&SIGMA_MAX_CHANGE),
        }
    }
}

impl Pgpe {
    fn genotype(&self, e: &[f64]) -> Genotype {
        let genes = self.mu.iter().zip(&self.sigma).zip(e);
        genes.map(|((mu, sigma), e)| (mu + sigma * e).clamp(0.0, 1.0)).collect()
    }

    /// ClipUp: v = momentum v + `step_size` g/|g|, shortened to `max_speed`; mu += v.
    fn climb(&mut self, gradient: &[f64]) {
        let gradient_length = length(gradient);
        // Without a direction, the mean only goes on.
        let share = if gradient_length > 0.0 { self.step_size / gradient_length } else { 0.0 };
        for (v, g) in self.velocity.iter_mut().zip(gradient) {
            *v = self.momentum * *v + share * g;
        }
        let speed = length(&self.velocity);
        if speed > self.max_speed {
            self.velocity.iter_mut().for_each(|v| *v *= self.max_speed / speed);
        }
        for (mu, v) in self.mu.iter_mut().zip(&self.velocity) {
            *mu = (*mu + v).clamp(0.0, 1.0);
        }
    }
}

impl Strategy for Pgpe {
    fn n_genes(&self) -> usize {
        self.mu.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        Some(self.sigma.clone())
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mu)
    }

    /// g_2k = clip(mu + sigma e_k), g_2k+1 = clip(mu - sigma e_k), e_k ~ N(0, I). The last
    /// individual of an odd population is mu itself: it has a rank and adds nothing.
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let normals = draw_pairs(population_size, self.mu.len(), rng);
        let genotypes = normals.iter().map(|e| self.genotype(e)).collect();
        Sample::new(genotypes, normals)
    }

    fn draws_one_by_one(&self) -> bool {
        true
    }

    fn individual(&self, index: usize, n: usize, rng: &mut Stream) -> Option<Genotype> {
        Some(self.genotype(&draw_of_pairs(index, n, self.mu.len(), rng)))
    }

    /// With centred ranks c and n pairs: a step of ClipUp along sum_i c_i sigma e_i; sigma +=
    /// `eta_sigma`/n sum_k (c_2k + c_2k+1)/2 sigma (e_k^2 - 1), by at most the allowed share.
    /// The draws enter without clipping.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mu.len();
        let ranks = centred_ranks(ranking);
        let mut gradient_mu = vec![0.0; d];
        let mut gradient_sigma = vec![0.0; d];
        // The last individual of an odd population has no partner.
        for (pair, e) in ranks.chunks_exact(2).zip(sample.normals.iter().step_by(2)) {
            let (difference, mean) = (pair[0] - pair[1], (pair[0] + pair[1]) / 2.0);
            for j in 0..d {
                gradient_mu[j] += difference * self.sigma[j] * e[j];
                gradient_sigma[j] += mean * self.sigma[j] * (e[j] * e[j] - 1.0);
            }
        }
        self.climb(&gradient_mu);
        let n_pairs = (ranks.len() / 2) as f64;
        for (sigma, gradient) in self.sigma.iter_mut().zip(&gradient_sigma) {
            let most = self.sigma_max_change * *sigma;
            let change = (self.eta_sigma / n_pairs * gradient).clamp(-most, most);
            *sigma = (*sigma + change).clamp(DEVIATION_MIN, 1.0);
        }
    }
}

fn length(vector: &[f64]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

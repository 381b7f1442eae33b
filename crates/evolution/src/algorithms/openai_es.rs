//! OpenAI's evolution strategy.
//!
//! Salimans, Ho, Chen, Sidor, Sutskever: "Evolution strategies as a scalable
//! alternative to reinforcement learning", arXiv 1703.03864 (2017): mirrored
//! perturbations, centred ranks, and Adam (Kingma, Ba: arXiv 1412.6980,
//! Algorithm 1) on the estimated gradient.

use determinism::random::Stream;
use experiment_file::{AlgorithmDescription, Keeps, LearnsFrom, Parameter, Params};
use serde::{Deserialize, Serialize};

use super::{
    Described, Sample, Strategy,
    pairs::{centred_ranks, draw_of_pairs, draw_pairs},
    parameters::MU_INIT,
};
use crate::Genotype;

/// A Gaussian whose mean mu, kept in \[0, 1\], learns, and whose standard
/// deviation sigma is the same for all genes and constant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenAiEs {
    mu: Vec<f64>,
    mu_init: f64,
    sigma: f64,
    learning_rate: f64,
    beta1: f64,
    beta2: f64,
    weight_decay: f64,
    /// Adam's moments of the gradient, and its number of steps.
    first_moment: Vec<f64>,
    second_moment: Vec<f64>,
    n_updates: u64,
}

/// Adam's epsilon.
const EPSILON: f64 = 1e-8;

/// Largest decay: with a decay of 1, Adam would never forget, and its correction would divide by
/// zero.
const DECAY_MAX: f64 = 1.0 - f64::EPSILON;

const SIGMA: Parameter =
    Parameter::deviation("sigma", 0.1, "Standard deviation of the perturbations");
const LEARNING_RATE: Parameter = Parameter::positive("learning_rate", 0.02, "Adam's step size");
const BETA1: Parameter =
    Parameter::between("beta1", [0.0, DECAY_MAX], 0.9, "Adam's decay of the first moment");
const BETA2: Parameter =
    Parameter::between("beta2", [0.0, DECAY_MAX], 0.999, "Adam's decay of the second moment");
const WEIGHT_DECAY: Parameter =
    Parameter::unit("weight_decay", 0.0, "L2 pull towards `mu_init` per generation");

impl Described for OpenAiEs {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "openaiES",
        title: "OpenAI's evolution strategy",
        learns: "mean",
        state: "3 d",
        keeps: Keeps::Vectors,
        individuals_min: 2,
        learns_from: LearnsFrom::Pairs,
        genes_max: None,
        parameters: &[MU_INIT, SIGMA, LEARNING_RATE, BETA1, BETA2, WEIGHT_DECAY],
    };

    fn start(params: &Params, d: usize) -> Self {
        let mu_init = params.value_of(&MU_INIT);
        Self {
            mu: vec![mu_init; d],
            mu_init,
            sigma: params.value_of(&SIGMA),
            learning_rate: params.value_of(&LEARNING_RATE),
            beta1: params.value_of(&BETA1),
            beta2: params.value_of(&BETA2),
            weight_decay: params.value_of(&WEIGHT_DECAY),
            first_moment: vec![0.0; d],
            second_moment: vec![0.0; d],
            n_updates: 0,
        }
    }
}

impl OpenAiEs {
    fn genotype(&self, e: &[f64]) -> Genotype {
        self.mu.iter().zip(e).map(|(mu, e)| (mu + self.sigma * e).clamp(0.0, 1.0)).collect()
    }
}

impl Strategy for OpenAiEs {
    fn n_genes(&self) -> usize {
        self.mu.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        Some(vec![self.sigma; self.mu.len()])
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mu)
    }

    /// g_2k = clip(mu + sigma * e_k), g_2k+1 = clip(mu - sigma * e_k), e_k ~ N(0, I). The last
    /// individual of an odd population is mu itself: it has a rank and adds nothing to the
    /// gradient.
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

    /// With the centred ranks c = 1/2 (best) to -1/2 (worst), evenly spaced:
    /// gradient = sum_i c_i e_i / (P sigma) - weight_decay * (mu - mu_init),
    /// and a step of Adam uphill.
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mu.len();
        let n = ranking.len();
        let mut sum = vec![0.0; d];
        for (rank, e) in centred_ranks(ranking).iter().zip(&sample.normals) {
            for j in 0..d {
                sum[j] += rank * e[j];
            }
        }

        self.n_updates += 1;
        let correction1 = 1.0 - libm::pow(self.beta1, self.n_updates as f64);
        let correction2 = 1.0 - libm::pow(self.beta2, self.n_updates as f64);
        let moments = self.first_moment.iter_mut().zip(&mut self.second_moment);
        for ((mu, sum), (first, second)) in self.mu.iter_mut().zip(&sum).zip(moments) {
            let pull = self.weight_decay * (*mu - self.mu_init);
            let gradient = sum / (n as f64 * self.sigma) - pull;
            *first = self.beta1 * *first + (1.0 - self.beta1) * gradient;
            *second = self.beta2 * *second + (1.0 - self.beta2) * gradient * gradient;
            let step = (*first / correction1) / ((*second / correction2).sqrt() + EPSILON);
            *mu = (*mu + self.learning_rate * step).clamp(0.0, 1.0);
        }
    }
}

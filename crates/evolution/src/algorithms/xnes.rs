//! Exponential natural evolution strategy.
//!
//! Glasmachers, Schaul, Sun, Wierstra, Schmidhuber: "Exponential natural
//! evolution strategies", GECCO 2010; Wierstra et al.: "Natural evolution
//! strategies", JMLR 15 (2014); the thesis's Algorithm 2.

use determinism::random::Stream;
use experiment_file::{
    AlgorithmDescription, DefaultValue, Domain, Keeps, LearnsFrom, Parameter, Params, limits,
};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::{
    Described, Sample, Strategy, draw_normals, finite_exp,
    linalg::{Eigen, Symmetric, product},
    mirror,
    parameters::{ETA_MU, MU_INIT, SIGMA_INIT},
};
use crate::ranking::utility_per_individual;

/// A Gaussian with mean mu and covariance A A^T, A = sigma B, det B = 1, of points
/// in all of R^d that are mirrored into genotypes, as in CMA-ES. sigma is kept in
/// \[0, 1\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Xnes {
    mu: Vec<f64>,
    sigma: f64,
    /// B, column by column.
    shape: Vec<f64>,
    eta_mu: f64,
    eta_sigma: f64,
    eta_b: f64,
}

/// Largest absolute entry of B. An update that would exceed it is skipped, so that genes stay
/// finite; this happens only with learning rates far above the defaults.
const SHAPE_MAX: f64 = 1e100;

const ETA_SIGMA: Parameter = Parameter::computed(
    "eta_sigma",
    "(9 + 3 ln d)/(5 d sqrt d); `fast`: (3 + ln d)/(5 sqrt d)",
    "Learning rate of the step size sigma",
);
const ETA_B: Parameter = Parameter::computed(
    "eta_B",
    "`eta_sigma`; `fast`: (18 + 6 ln d)/(5 d sqrt d)",
    "Learning rate of the shape B",
);
/// The name of the faster rates.
const FAST: &str = "fast";
/// Chooses between the paper's rates and faster rates. With the faster rates, the step size learns
/// as fast as SNES's deviations, and the shape learns twice as fast as the paper's. The canonical
/// form omits an absent key, because older files lack it.
const RATES: Parameter = Parameter::of(
    "rates",
    Domain::OneOf { names: &["paper", FAST], unsupported: &[] },
    DefaultValue::Formula("`paper`"),
    "Which learning rates are the defaults. New files should state `fast`",
);

impl Described for Xnes {
    const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "xNES",
        title: "Exponential natural evolution strategy",
        learns: "mean, step size, shape",
        state: "d²",
        keeps: Keeps::Matrix,
        individuals_min: 1,
        learns_from: LearnsFrom::Ranks,
        genes_max: Some(limits::GENES_OF_FULL_MATRIX),
        parameters: &[ETA_MU, ETA_SIGMA, ETA_B, MU_INIT, SIGMA_INIT, RATES],
    };

    /// B = I.
    fn start(params: &Params, d: usize) -> Self {
        let size = d as f64;
        let default_eta = (9.0 + 3.0 * libm::log(size)) / (5.0 * size * size.sqrt());
        let is_fast = params.get(&RATES) == Some(FAST.into());
        let default_sigma = if is_fast { default_eta * size / 3.0 } else { default_eta };
        let eta_sigma = params.value_of::<Option<f64>>(&ETA_SIGMA).unwrap_or(default_sigma);
        let default_b = if is_fast { 2.0 * default_eta } else { eta_sigma };
        Self {
            mu: vec![params.value_of(&MU_INIT); d],
            sigma: params.value_of(&SIGMA_INIT),
            shape: DMatrix::<f64>::identity(d, d).as_slice().to_vec(),
            eta_mu: params.value_of(&ETA_MU),
            eta_sigma,
            eta_b: params.value_of::<Option<f64>>(&ETA_B).unwrap_or(default_b),
        }
    }
}

impl Xnes {
    fn shape(&self) -> DMatrix<f64> {
        DMatrix::from_column_slice(self.mu.len(), self.mu.len(), &self.shape)
    }
}

impl Strategy for Xnes {
    fn n_genes(&self) -> usize {
        self.mu.len()
    }

    fn deviations(&self) -> Option<Vec<f64>> {
        let d = self.mu.len();
        let row = |j: usize| self.shape.iter().skip(j).step_by(d);
        let length = |j| row(j).map(|b| b * b).sum::<f64>().sqrt();
        Some((0..d).map(|j| self.sigma * length(j)).collect())
    }

    fn mean(&self) -> Option<&[f64]> {
        Some(&self.mu)
    }

    /// x_i = mu + sigma * B s_i, s_i ~ N(0, I).
    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let shape = self.shape();
        let normals = draw_normals(population_size, self.mu.len(), rng);
        let genotypes = normals
            .iter()
            .map(|s| {
                let step = &shape * DVector::from_column_slice(s);
                let gene = |(mu, step): (&f64, &f64)| mirror(mu + self.sigma * step);
                self.mu.iter().zip(&step).map(gene).collect()
            })
            .collect();
        Sample::new(genotypes, normals)
    }

    /// With G_delta = sum_i u_i s_i, G_M = sum_i u_i (s_i s_i^T - I),
    /// G_sigma = tr(G_M) / d, G_B = G_M - G_sigma I:
    /// mu += eta_mu * sigma * B G_delta; sigma *= exp(eta_sigma / 2 * G_sigma);
    /// B *= expm(eta_B / 2 * G_B).
    fn learn(&mut self, sample: &Sample, ranking: &[usize], _fitness: &[f64]) {
        let d = self.mu.len();
        let mut gradient_delta = DVector::zeros(d);
        let mut gradient_m = Symmetric::zero(d);
        let mut sum_of_utilities = 0.0;
        for (&utility, s) in utility_per_individual(ranking).iter().zip(&sample.normals) {
            gradient_delta.axpy(utility, &DVector::from_column_slice(s), 1.0);
            gradient_m.add_outer(utility, s);
            sum_of_utilities += utility;
        }
        let mut gradient_b = gradient_m.to_dense();
        let gradient_sigma = gradient_b.trace() / d as f64 - sum_of_utilities;
        for i in 0..d {
            gradient_b[(i, i)] -= sum_of_utilities + gradient_sigma;
        }

        let shape = self.shape();
        let step = &shape * gradient_delta;
        for (mu, step) in self.mu.iter_mut().zip(&step) {
            *mu += self.eta_mu * self.sigma * step;
        }
        let factor = finite_exp(self.eta_sigma / 2.0 * gradient_sigma);
        self.sigma = (self.sigma * factor).clamp(0.0, 1.0);
        let next = times_exponential(&shape, &(gradient_b * (self.eta_b / 2.0)));
        if next.iter().all(|entry| entry.abs() <= SHAPE_MAX) {
            self.shape = next.as_slice().to_vec();
        }
    }
}

/// `a` * expm(`symmetric`), by eigenvalues: expm(V diag(l) V^T) =
/// V diag(exp l) V^T. nalgebra's own exponential takes powers and logarithms of
/// floats and multiplies matrices by kernels that differ between processors.
fn times_exponential(a: &DMatrix<f64>, symmetric: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = Eigen::new(symmetric);
    let mut scaled = product(a, &eigen.vectors);
    for (mut column, value) in scaled.column_iter_mut().zip(&eigen.values) {
        column *= finite_exp(*value);
    }
    product(&scaled, &eigen.vectors.transpose())
}

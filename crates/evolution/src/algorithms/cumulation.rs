//! The common part of CMA-ES and sep-CMA-ES: evolution paths and the cumulative adaptation of the
//! step size.
//!
//! Hansen: "The CMA evolution strategy: a tutorial", arXiv 1604.00772; equation numbers refer to
//! this paper.

use serde::{Deserialize, Serialize};

/// Smallest standard deviation of a gene in both variants, so that sampled genes differ from the
/// mean by more than rounding. The step size is at most 1, the side of the cube.
pub const DEVIATION_MIN: f64 = 1e-10;

/// Largest variance of C, because sums of squares would overflow in the decomposition. Selection
/// that always takes the farthest individual drives C there.
pub const VARIANCE_MAX: f64 = 1e150;

/// Learning rates, for d genes and a population of lambda.
#[derive(Debug, Clone, PartialEq)]
pub struct Rates {
    /// Variance-effective number of parents.
    pub mu_eff: f64,
    /// Learning rate of the step size's path.
    pub c_sigma: f64,
    /// Damping of the step size.
    pub d_sigma: f64,
    /// Learning rate of the covariance's path.
    pub c_c: f64,
    /// Learning rate of the rank-one update.
    pub c_1: f64,
    /// Learning rate of the rank-mu update.
    pub c_mu: f64,
}

/// The step size sigma and the two evolution paths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cumulation {
    /// sigma, in \[[`DEVIATION_MIN`], 1\].
    pub sigma: f64,
    p_sigma: Vec<f64>,
    /// Path of the covariance.
    pub p_c: Vec<f64>,
    n_updates: u64,
}

impl Cumulation {
    /// Paths of length 0 over `d` genes.
    pub fn new(sigma: f64, d: usize) -> Self {
        Self {
            sigma: sigma.clamp(DEVIATION_MIN, 1.0),
            p_sigma: vec![0.0; d],
            p_c: vec![0.0; d],
            n_updates: 0,
        }
    }

    /// Eq. 43 to 45, with sigma clipped to its bounds. `y_mean`: the weighted mean of the
    /// parents' steps in units of sigma; `z_mean`: the same multiplied by C^(-1/2). Returns
    /// delta(h_sigma), the share of variance that the rank-one update lacks while its path is
    /// stalled.
    pub fn update(&mut self, rates: &Rates, y_mean: &[f64], z_mean: &[f64]) -> f64 {
        self.n_updates += 1;
        let (c_sigma, c_c) = (rates.c_sigma, rates.c_c);
        let gain = (c_sigma * (2.0 - c_sigma) * rates.mu_eff).sqrt();
        for (p, z) in self.p_sigma.iter_mut().zip(z_mean) {
            *p = (1.0 - c_sigma) * *p + gain * z;
        }
        let length = self.p_sigma.iter().map(|p| p * p).sum::<f64>().sqrt();

        let d = self.p_sigma.len() as f64;
        let expected = d.sqrt() * (1.0 - 1.0 / (4.0 * d) + 1.0 / (21.0 * d * d));
        let share = 1.0 - libm::pow(1.0 - c_sigma, 2.0 * self.n_updates as f64);
        let is_short = length / share.sqrt() < (1.4 + 2.0 / (d + 1.0)) * expected;
        let h_sigma = if is_short { 1.0 } else { 0.0 };
        let gain = h_sigma * (c_c * (2.0 - c_c) * rates.mu_eff).sqrt();
        for (p, y) in self.p_c.iter_mut().zip(y_mean) {
            *p = (1.0 - c_c) * *p + gain * y;
        }

        let factor = libm::exp(c_sigma / rates.d_sigma * (length / expected - 1.0));
        self.sigma = (self.sigma * factor).clamp(DEVIATION_MIN, 1.0);
        (1.0 - h_sigma) * c_c * (2.0 - c_c)
    }

    /// Entry of the covariance's diagonal that corresponds to [`DEVIATION_MIN`].
    pub fn variance_min(&self) -> f64 {
        (DEVIATION_MIN / self.sigma) * (DEVIATION_MIN / self.sigma)
    }
}

/// d_sigma of both variants (Eq. 55).
pub fn damping(d: f64, mu_eff: f64, c_sigma: f64) -> f64 {
    1.0 + 2.0 * (((mu_eff - 1.0) / (d + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma
}

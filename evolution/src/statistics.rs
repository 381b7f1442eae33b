//! Statistics of a generation's fitness.

use super::mean;

/// Over the individuals whose fitness is finite; there is at least one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Largest fitness.
    pub best: f64,
    /// Mean fitness.
    pub mean: f64,
    /// Smallest fitness.
    pub min: f64,
    /// Population standard deviation (divisor n).
    pub standard_deviation: f64,
}

impl Statistics {
    /// Statistics of the finite values among `fitness`.
    pub fn of(fitness: &[f64]) -> Self {
        let finite: Vec<f64> = fitness.iter().copied().filter(|value| value.is_finite()).collect();
        assert!(!finite.is_empty(), "a generation without finite fitness fails before");
        let mean = mean(&finite);
        let variance = finite.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>()
            / finite.len() as f64;
        Self {
            best: finite.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean,
            min: finite.iter().copied().fold(f64::INFINITY, f64::min),
            standard_deviation: variance.sqrt(),
        }
    }
}

//! Statistics of samples. Sums run in the order of the trials, so that the same
//! trials give the same bits.

use std::fmt;

use evolution::{between, deviation, finite_mean, interval::interval};
use schemars::JsonSchema;
use serde::Serialize;

use crate::text::number;

/// Upper 2.5 % point of the standard normal distribution: 95 % of it lie within.
const Z: f64 = 1.959_963_984_540_054;

/// Median and quartiles, by linear interpolation between the sorted values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Quartiles {
    /// The median.
    pub median: f64,
    /// The lower quartile.
    pub q1: f64,
    /// The upper quartile.
    pub q3: f64,
}

impl Quartiles {
    /// None if there are no values.
    pub fn from_values(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let last = values.len().checked_sub(1)?;
        let quantile = |p: f64| {
            let place = p * last as f64;
            let low = place as usize;
            let high = (low + 1).min(last);
            between(values[low], values[high], place - low as f64)
        };
        Some(Self { median: quantile(0.5), q1: quantile(0.25), q3: quantile(0.75) })
    }
}

/// Statistics of a sample, and confidence intervals of its mean.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Estimate {
    /// Size of the sample.
    pub n: usize,
    /// Mean of the sample.
    pub mean: f64,
    /// Standard deviation of the sample, with n - 1 in its denominator; 0 for n = 1.
    pub standard_deviation: f64,
    /// Lower and upper end of the 95 % confidence interval of the mean, by empirical likelihood.
    pub ci95: [f64; 2],
    /// For shares only: mean -+ z sqrt(mean (1 - mean) / n), Eq. 6.1 of the thesis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proportion_ci95: Option<[f64; 2]>,
    #[serde(flatten)]
    pub quartiles: Quartiles,
    /// The least value.
    pub min: f64,
    /// The greatest value.
    pub max: f64,
}

impl Estimate {
    /// None if there are no values, or one is not finite. `is_share`: whether the values lie in
    /// [0, 1].
    pub fn from_values(values: &[f64], is_share: bool) -> Option<Self> {
        let quartiles = Quartiles::from_values(values.to_vec())?;
        let n = values.len() as f64;
        let finite_mean = finite_mean(values)?;
        let deviation = match values.len() - 1 {
            0 => 0.0,
            divisor => deviation(values, finite_mean, divisor).get(),
        };
        // Without the sign of zero.
        let mean = finite_mean.get() + 0.0;
        let (low, high) = interval(values)?;
        let around = |radius: f64| [mean - radius, mean + radius];
        // Rounding must not make the root's argument negative.
        let proportion = || around(Z * ((mean * (1.0 - mean)).max(0.0) / n).sqrt());
        Some(Self {
            n: values.len(),
            mean,
            standard_deviation: deviation,
            ci95: [low.get(), high.get()],
            proportion_ci95: is_share.then(proportion),
            quartiles,
            min: values.iter().copied().fold(f64::INFINITY, f64::min),
            max: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        })
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.ci95;
        let [mean, low, high] = [self.mean, low, high].map(|value| number(value, 3));
        write!(f, "{mean} [{low}, {high}]")
    }
}

/// The mean; none if there are no values. The mean of finite values is finite.
pub fn mean(values: &[f64]) -> Option<f64> {
    let sum = values.iter().fold(0.0, |sum, value| sum + value);
    let plain = (!values.is_empty()).then(|| sum / values.len() as f64)?;
    Some(finite_mean(values).filter(|_| !plain.is_finite()).map_or(plain, f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_interpolate_as_numpy_does() {
        // numpy.quantile([4, 1, 3, 2], [0.5, 0.25, 0.75])
        let quartiles = Quartiles::from_values(vec![4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!(quartiles, Quartiles { median: 2.5, q1: 1.75, q3: 3.25 });
        let one = Quartiles::from_values(vec![7.0]).unwrap();
        assert_eq!(one, Quartiles { median: 7.0, q1: 7.0, q3: 7.0 });
        assert_eq!(Quartiles::from_values(vec![]), None);
    }

    #[test]
    fn the_interval_of_a_proportion_is_that_of_equation_6_1() {
        // 40 of 50: 0.8 -+ 1.96 sqrt(0.8 * 0.2 / 50).
        let values: Vec<f64> = (0..50).map(|trial| f64::from(u8::from(trial < 40))).collect();
        let [low, high] = Estimate::from_values(&values, true).unwrap().proportion_ci95.unwrap();
        assert!((low - 0.689_128).abs() < 1e-6 && (high - 0.910_872).abs() < 1e-6, "{low} {high}");
    }

    #[test]
    fn the_interval_of_a_mean_is_as_lopsided_as_the_values() {
        let estimate = Estimate::from_values(&[1.0, 1.0, 1.0, 1.0, 1.0, 0.0], true).unwrap();
        let [low, high] = estimate.ci95;
        assert!(0.0 < low && estimate.mean < high && high < 1.0, "{low} {high}");
        assert!(estimate.mean - low > 2.0 * (high - estimate.mean), "{low} {high}");
        assert_eq!(Estimate::from_values(&[1.0, f64::NAN], false), None);
    }

    #[test]
    fn the_spread_is_that_of_a_sample() {
        let estimate = Estimate::from_values(&[1.0, 2.0, 3.0, 4.0], false).unwrap();
        assert_eq!((estimate.mean, estimate.min, estimate.max), (2.5, 1.0, 4.0));
        assert!((estimate.standard_deviation - 1.290_994).abs() < 1e-6);
        assert_eq!(estimate.proportion_ci95, None);
    }

    #[test]
    fn a_sample_of_one_or_of_equals_has_no_spread() {
        for values in [&[0.1][..], &[0.1; 50]] {
            let estimate = Estimate::from_values(values, true).unwrap();
            assert!(estimate.standard_deviation < 1e-15);
            assert!((estimate.ci95[0] - 0.1).abs() < 1e-15);
        }
        let all = Estimate::from_values(&[1.0; 3], true).unwrap();
        assert_eq!(all.proportion_ci95, Some([1.0, 1.0]));
        assert_eq!(Estimate::from_values(&[], true), None);
    }

    #[test]
    fn values_of_every_size_have_an_estimate_of_numbers() {
        let tiny = |step: u64| f64::from_bits(step);
        for values in [
            [tiny(0), tiny(1), tiny(3)],
            [0.0, 1e-300, 2e-300],
            [1e308, 1.5e308, f64::MAX],
            [f64::MIN, 0.0, f64::MAX],
            [f64::MIN, f64::MAX, f64::MAX],
        ] {
            let estimate = Estimate::from_values(&values, false).unwrap();
            let json = serde_json::to_string(&estimate).unwrap();
            assert!(!json.contains("null"), "{json}");
            let [low, high] = estimate.ci95;
            assert!(values[0] <= low && low <= high && high <= values[2], "{estimate:?}");
        }
    }
}

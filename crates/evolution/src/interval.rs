//! A confidence interval for the mean of a skewed distribution: empirical likelihood
//! (Owen 1988, Biometrika 75, 237-249).
//!
//! Fitness is bounded and often far from normal: a champion may fail one trial in thirty and be
//! near perfect in all others. The mean plus or minus 1.96 s / sqrt(n) then misses the truth too
//! often, and almost always on the same side. Empirical likelihood assumes no distribution: a
//! mean belongs to the interval if weights w_i on the n trials have that mean and are not too
//! unequal, -2 sum ln(n w_i) <= q. The interval lies between the smallest and the largest trial,
//! and is as skewed as the trials are. q is the square of Student's t with n - 1 degrees of
//! freedom, which is somewhat wider than the chi-squared of large n.

use super::{Real, statistics::bounds};

/// 0.975 quantile of the normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// Number of halvings of the range of an exponent, enough for full precision.
const N_HALVINGS: u32 = 60;
/// Largest absolute exponent of two in the search.
const EXPONENT_MAX: f64 = 60.0;

/// The 95 % confidence interval of the mean; `None` without values, or if one is not finite. The
/// interval never leaves the range of the values: if all values are equal, both ends are that
/// value.
pub fn interval(values: &[f64]) -> Option<(Real, Real)> {
    if values.is_empty() || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mirrored: Vec<f64> = values.iter().map(|value| -value).collect();
    Some((Real::finite(-upper_end(&mirrored))?, Real::finite(upper_end(values))?))
}

/// The upper end of the interval: the largest mean that weighted values may have.
fn upper_end(values: &[f64]) -> f64 {
    let (min, max) = bounds(values);
    if min == max {
        return max;
    }
    // Scaling by a power of two changes no significant bit, unless a number would overflow or
    // underflow. The range itself may overflow.
    let range = max - min;
    let exponent =
        if range.is_finite() { libm::ilogb(range) } else { libm::ilogb(max / 2.0 - min / 2.0) + 1 };
    let scaled: Vec<f64> = values.iter().map(|&value| libm::scalbn(value, -exponent)).collect();
    libm::scalbn(scaled_upper_end(&scaled), exponent).clamp(min, max)
}

/// The upper end for values whose range is about 1. Among weights with a given mean above that of
/// the sample, the likeliest are w_i = c / (max + d - x_i); a smaller d gives a larger mean.
fn scaled_upper_end(values: &[f64]) -> f64 {
    let (min, max) = bounds(values);
    let range = max - min;
    let (mut near, mut far) = (-EXPONENT_MAX, EXPONENT_MAX);
    let bound = quantile(values.len());
    for _ in 0..N_HALVINGS {
        let middle = 0.5 * (near + far);
        if weighted(values, max, range * libm::exp2(middle)).1 > bound {
            near = middle;
        } else {
            far = middle;
        }
    }
    weighted(values, max, range * libm::exp2(far)).0
}

/// The mean with weights c / (max + d - x_i), and -2 sum ln(n w_i).
fn weighted(values: &[f64], max: f64, d: f64) -> (f64, f64) {
    let n = values.len() as f64;
    let raw = |value: &f64| 1.0 / ((max - value) + d);
    let sum: f64 = values.iter().map(raw).sum();
    let below: f64 = values.iter().map(|value| (max - value) * raw(value)).sum();
    let logs: f64 = values.iter().map(|value| libm::log(n * raw(value) / sum)).sum();
    (max - below / sum, -2.0 * logs)
}

/// The square of the 0.975 quantile of Student's t with n - 1 degrees of freedom
/// (Abramowitz & Stegun 26.7.5; right to 1 % from n = 4 on, and to 1e-6 from n = 20).
fn quantile(n: usize) -> f64 {
    let (v, z2) = (n as f64 - 1.0, Z * Z);
    let first = (z2 + 1.0) / 4.0;
    let second = ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
    let third = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
    let t = Z * (1.0 + (first + (second + third / v) / v) / v);
    t * t
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::statistics::tests::any_finite;

    /// Fitness of 200 trials, with 8 failures.
    fn rarely_fails() -> Vec<f64> {
        (0..200).map(|i| if i % 25 == 0 { 0.01 } else { 0.9 + 0.0004 * f64::from(i) }).collect()
    }

    fn ends(values: &[f64]) -> (f64, f64) {
        let (low, high) = interval(values).unwrap();
        (low.get(), high.get())
    }

    /// -2 ln R(mu) by its definition, with the weights 1 / (n (1 + lambda (x_i - mu))) of mean
    /// mu.
    fn statistic(values: &[f64], mu: f64) -> f64 {
        let min = values.iter().copied().fold(f64::INFINITY, f64::min);
        let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (mut low, mut high) = (1.0 / (mu - max), 1.0 / (mu - min));
        for _ in 0..200 {
            let lambda = 0.5 * (low + high);
            let excess: f64 = values.iter().map(|x| (x - mu) / (1.0 + lambda * (x - mu))).sum();
            if excess > 0.0 { low = lambda } else { high = lambda }
        }
        2.0 * values.iter().map(|x| libm::log(1.0 + low * (x - mu))).sum::<f64>()
    }

    #[test]
    fn both_ends_have_the_likelihood_of_the_quantile() {
        for values in [rarely_fails(), vec![0.0, 1.0, 5.0, 2.0, 2.0, 7.0]] {
            let (low, high) = ends(&values);
            for end in [low, high] {
                let (found, expected) = (statistic(&values, end), quantile(values.len()));
                assert!((found - expected).abs() < 1e-6, "{end}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_quantile_is_the_square_of_students() {
        // 2.570582 and 1.971957: tables of t with 5 and 199 degrees of freedom.
        assert!((quantile(6).sqrt() - 2.570_582).abs() < 3e-3);
        assert!((quantile(200).sqrt() - 1.971_957).abs() < 1e-6);
    }

    #[test]
    fn the_interval_reaches_farther_to_the_side_of_the_rare_failures() {
        let values = rarely_fails();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let (low, high) = ends(&values);
        assert!(low < mean && mean < high);
        assert!(mean - low > 1.2 * (high - mean), "{low} {mean} {high}");
    }

    #[test]
    fn the_interval_scales_and_shifts_with_the_values() {
        let values = rarely_fails();
        let (low, high) = ends(&values);
        let moved: Vec<f64> = values.iter().map(|value| 5.0 - 3.0 * value).collect();
        let (moved_low, moved_high) = ends(&moved);
        assert!((moved_low - (5.0 - 3.0 * high)).abs() < 1e-9);
        assert!((moved_high - (5.0 - 3.0 * low)).abs() < 1e-9);
    }

    #[test]
    fn equal_values_have_a_point_as_interval_and_non_finite_values_have_none() {
        assert_eq!(ends(&[0.25]), (0.25, 0.25));
        assert_eq!(ends(&[0.25; 9]), (0.25, 0.25));
        assert_eq!(interval(&[]), None);
        assert_eq!(interval(&[0.25, f64::NAN]), None);
        let (low, high) = ends(&[0.0, 1.0]);
        assert!((0.0..0.1).contains(&low) && (0.9..=1.0).contains(&high), "{low} {high}");
    }

    /// The upper end without scaling, as long as it is a number.
    fn unscaled_upper_end(values: &[f64]) -> f64 {
        let (min, max) = bounds(values);
        if min == max { max } else { scaled_upper_end(values) }
    }

    proptest! {
        #[test]
        fn scaling_changes_no_bit_of_finite_ends(
            values in prop::collection::vec(-1e9f64..1e9, 1..60),
            exponent in -600i32..600,
            offset in -1e12f64..1e12,
        ) {
            for offset in [0.0, offset] {
                let scale = |value: &f64| libm::scalbn(value + offset, exponent);
                let values: Vec<f64> = values.iter().map(scale).collect();
                let expected = unscaled_upper_end(&values);
                prop_assert_eq!(upper_end(&values).to_bits(), expected.to_bits());
            }
        }

        #[test]
        fn finite_values_have_a_finite_interval_between_the_smallest_and_the_largest(
            values in prop::collection::vec(any_finite(), 1..40),
        ) {
            let (low, high) = ends(&values);
            let (min, max) = bounds(&values);
            prop_assert!(min <= low && low <= high && high <= max, "{low:e} {high:e}");
        }

        #[test]
        fn the_smallest_numbers_have_an_interval_like_any_others(
            steps in prop::collection::vec(0u64..1000, 2..40),
        ) {
            // The smallest positive numbers, and the same numbers scaled to integers.
            let tiny: Vec<f64> = steps.iter().map(|&step| f64::from_bits(step)).collect();
            let whole: Vec<f64> = steps.iter().map(|&step| step as f64).collect();
            let (found, expected) = (ends(&tiny), ends(&whole));
            prop_assert_eq!(found.0.to_bits() as f64, expected.0.round_ties_even());
            prop_assert_eq!(found.1.to_bits() as f64, expected.1.round_ties_even());
        }
    }
}

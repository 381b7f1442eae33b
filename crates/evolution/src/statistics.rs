//! Means and deviations of fitness: finite for finite values, however large.

use super::{Real, mean};

/// Divisor of values before summing squares that would overflow: a power of two, so that only
/// negligible values lose bits.
const SCALE: f64 = f64::from_bits((1023 + 600) << 52);

/// Statistics over the individuals with finite fitness, at least one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Largest fitness.
    pub best: Real,
    /// Mean fitness.
    pub mean: Real,
    /// Smallest fitness.
    pub min: Real,
    /// Population standard deviation (divisor n).
    pub standard_deviation: Real,
}

impl Statistics {
    /// Statistics of the finite values among `fitness`.
    ///
    /// # Panics
    ///
    /// If no value is finite.
    pub fn from_fitness(fitness: &[f64]) -> Self {
        let finite: Vec<f64> = fitness.iter().copied().filter(|value| value.is_finite()).collect();
        let expected = "a generation without finite fitness fails earlier";
        let mean = finite_mean(&finite).expect(expected);
        let (min, max) = bounds(&finite);
        Self {
            best: Real::finite(max).expect(expected),
            mean,
            min: Real::finite(min).expect(expected),
            standard_deviation: deviation(&finite, mean, finite.len()),
        }
    }
}

/// Smallest and largest of finite values.
pub(crate) fn bounds(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), &value| {
        (min.min(value), max.max(value))
    })
}

/// The mean, summed in order; `None` without values, or if one is not finite.
pub fn finite_mean(values: &[f64]) -> Option<Real> {
    if values.is_empty() || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    Real::finite(mean(values)).or_else(|| {
        let scaled: Vec<f64> = values.iter().map(|value| value / SCALE).collect();
        let (min, max) = bounds(values);
        Real::finite((mean(&scaled) * SCALE).clamp(min, max))
    })
}

/// The square root of the sum of squared differences from the mean, divided by `divisor`.
/// `values`: finite.
pub fn deviation(values: &[f64], mean: Real, divisor: usize) -> Real {
    let root = |scale: f64| {
        let mean = mean.get() / scale;
        let differences = values.iter().map(|value| value / scale - mean);
        let squares = differences.map(|difference| difference * difference).sum::<f64>();
        (squares / divisor as f64).sqrt()
    };
    Real::finite(root(1.0))
        .unwrap_or_else(|| Real::finite((root(SCALE) * SCALE).min(f64::MAX)).unwrap_or_default())
}

/// The value at `share` of the way from `low` to `high`, both finite.
pub fn between(low: f64, high: f64, share: f64) -> f64 {
    let rise = high - low;
    if rise.is_finite() { low + share * rise } else { low * (1.0 - share) + high * share }
}

#[cfg(test)]
pub(crate) mod tests {
    use proptest::prelude::*;

    use super::*;

    /// All finite numbers, often extreme numbers.
    pub(crate) fn any_finite() -> impl Strategy<Value = f64> {
        let extreme = [0.0, -0.0, f64::MAX, f64::MIN, 5e-324, -5e-324, 1e308, 1.0, f64::EPSILON];
        prop_oneof![
            2 => any::<u64>()
                .prop_map(f64::from_bits)
                .prop_filter("finite", |number| number.is_finite()),
            1 => prop::sample::select(extreme.to_vec()),
            1 => (0u64..50).prop_map(f64::from_bits),
        ]
    }

    /// The same statistics without scaling.
    fn plain(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let squares = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
        (mean, (squares / values.len() as f64).sqrt())
    }

    proptest! {
        #[test]
        fn statistics_of_finite_values_are_finite_and_in_order(
            values in prop::collection::vec(any_finite(), 1..40),
        ) {
            let Statistics { best, mean, min, standard_deviation } =
                Statistics::from_fitness(&values);
            let slack = 4.0 * f64::EPSILON * best.get().abs().max(min.get().abs());
            prop_assert!(min.get() - slack <= mean.get() && mean.get() - slack <= best.get());
            prop_assert!(standard_deviation.get() >= 0.0);
        }

        #[test]
        fn scaling_changes_no_bit_of_finite_statistics(
            values in prop::collection::vec(any_finite(), 1..40),
        ) {
            let Statistics { mean, standard_deviation, .. } = Statistics::from_fitness(&values);
            let (plain_mean, plain_deviation) = plain(&values);
            if plain_mean.is_finite() {
                prop_assert_eq!(mean.get().to_bits(), plain_mean.to_bits());
            }
            if plain_mean.is_finite() && plain_deviation.is_finite() {
                prop_assert_eq!(standard_deviation.get().to_bits(), plain_deviation.to_bits());
            }
        }

        #[test]
        fn between_two_finite_values_there_is_a_finite_one(
            low in any_finite(), high in any_finite(), share in 0.0f64..=1.0,
        ) {
            let (low, high) = (low.min(high), low.max(high));
            let found = between(low, high, share);
            let slack = 4.0 * f64::EPSILON * low.abs().max(high.abs());
            prop_assert!(low - slack <= found && found - slack <= high, "{found}");
        }
    }

    #[test]
    fn sums_that_overflow_have_a_mean_and_a_deviation() {
        let of = Statistics::from_fitness(&[1.5e308, 1.5e308, 0.5e308, 0.5e308]);
        assert!((of.mean.get() / 1e308 - 1.0).abs() < 1e-15, "{of:?}");
        assert!((of.standard_deviation.get() / 0.5e308 - 1.0).abs() < 1e-15, "{of:?}");
        let of = Statistics::from_fitness(&[f64::MAX, f64::MIN]);
        assert_eq!((of.mean.get(), of.standard_deviation.get()), (0.0, f64::MAX));
    }
}

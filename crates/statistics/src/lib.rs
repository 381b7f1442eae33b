//! Statistics that compare runs: robust summaries of few runs, their bootstrap intervals, and
//! tests of whether one algorithm is better than another (Agarwal et al. 2021, "Deep
//! reinforcement learning at the edge of the statistical precipice").

mod bootstrap;
mod kendall;
mod ranks;

pub use bootstrap::{Interval, interval, interval_of_crossed, interval_of_two};
pub use kendall::{Kendall, kendall};
pub use ranks::{mann_whitney, probability_of_improvement};

/// The median; of an even number of values, the mean of the two middle values. NaN without values.
pub fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    quantile(values, 0.5)
}

/// The interquartile mean: the mean without the smallest and the largest quarter of the
/// values, each rounded down to whole values. NaN without values.
pub fn interquartile_mean(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let cut = values.len() / 4;
    let kept = &values[cut..values.len() - cut];
    mean(kept)
}

/// The mean; finite if all values are, even if their sum overflows. NaN without values.
pub fn mean(values: &[f64]) -> f64 {
    let plain = || values.iter().sum::<f64>() / values.len() as f64;
    evolution::finite_mean(values).map_or_else(plain, f64::from)
}

/// The quantile at p, in [0, 1], of sorted values, by linear interpolation between them. NaN
/// without values.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = p * last as f64;
    let low = (place as usize).min(last);
    let high = (low + 1).min(last);
    let share = place - low as f64;
    // Infinities stand for events that never happened; their difference would be NaN.
    match sorted[low] == sorted[high] || share == 0.0 {
        true => sorted[low],
        false => evolution::between(sorted[low], sorted[high], share),
    }
}

#[cfg(test)]
mod tests;

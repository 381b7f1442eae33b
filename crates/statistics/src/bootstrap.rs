//! Bootstrap intervals: the variation of a statistic when the runs are resampled with replacement
//! (percentile method; Efron & Tibshirani 1993, section 13.3).

use rand::RngExt as _;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng as _};
use schemars::JsonSchema;
use serde::Serialize;

use super::quantile;

/// Number of resamples.
const N_RESAMPLES: usize = 10_000;
/// Fixed, so that the same runs give the same interval.
const SEED: u64 = 0;

/// Smallest sample that has an interval.
const LEAST: usize = 3;

/// A statistic and its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Interval {
    /// The statistic of the sample itself.
    #[schemars(with = "Option<f64>")]
    pub value: f64,
    /// Lower and upper end of the 95 % interval; null if a sample has fewer than three runs, which
    /// are too few to resample.
    #[schemars(with = "Option<[Option<f64>; 2]>")]
    pub ci95: Option<[f64; 2]>,
}

/// A statistic of a sample, with its interval. `statistic` may reorder its argument.
pub fn interval(values: &[f64], statistic: impl Fn(&mut [f64]) -> f64) -> Interval {
    resample([values, &[]], |values, _| statistic(values))
}

/// A statistic of two samples, which are resampled independently.
pub fn interval_of_two(
    first: &[f64],
    second: &[f64],
    statistic: impl Fn(&mut [f64], &mut [f64]) -> f64,
) -> Interval {
    resample([first, second], statistic)
}

/// The mean of a table whose rows and columns are both samples, such as realities and trials. Rows
/// and columns are resampled independently (the pigeonhole bootstrap; Owen 2007), which is correct
/// or a little too wide if both vary. All rows have the same length.
pub fn interval_of_crossed(rows: &[Vec<f64>]) -> Interval {
    let (n, m) = (rows.len(), rows.first().map_or(0, Vec::len));
    let value = super::mean(&rows.concat());
    if n < LEAST || m < LEAST {
        return Interval { value, ci95: None };
    }
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut draw = |n: usize| rng.random_range(0..n as u32) as usize;
    let mut times = vec![0.0; m];
    let mut resampled: Vec<f64> = (0..N_RESAMPLES)
        .map(|_| {
            times.fill(0.0);
            (0..m).for_each(|_| times[draw(m)] += 1.0);
            let of_row = |row: &Vec<f64>| -> f64 {
                row.iter().zip(&times).map(|(value, times)| value / m as f64 * times).sum()
            };
            (0..n).map(|_| of_row(&rows[draw(n)]) / n as f64).sum()
        })
        .collect();
    resampled.sort_by(f64::total_cmp);
    Interval { value, ci95: Some([0.025, 0.975].map(|p| quantile(&resampled, p))) }
}

/// Resamples both samples. Statistics of one sample ignore the second one, which is empty.
fn resample(
    [first, second]: [&[f64]; 2],
    statistic: impl Fn(&mut [f64], &mut [f64]) -> f64,
) -> Interval {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let (mut a, mut b) = (first.to_vec(), second.to_vec());
    let value = statistic(&mut a, &mut b);
    if first.len() < LEAST || (1..LEAST).contains(&second.len()) {
        return Interval { value, ci95: None };
    }
    let mut draw = |from: &[f64], to: &mut Vec<f64>| {
        to.clear();
        to.extend(from.iter().map(|_| from[rng.random_range(0..from.len() as u32) as usize]));
    };
    let mut resampled: Vec<f64> = (0..N_RESAMPLES)
        .map(|_| {
            draw(first, &mut a);
            draw(second, &mut b);
            statistic(&mut a, &mut b)
        })
        .collect();
    resampled.sort_by(f64::total_cmp);
    Interval { value, ci95: Some([0.025, 0.975].map(|p| quantile(&resampled, p))) }
}

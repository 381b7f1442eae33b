//! Compares with rliable and scipy, whose results `crates/statistics/tests/fixtures/make.py`
//! wrote.

use serde::Deserialize;

use super::*;

#[derive(Debug, Deserialize)]
struct Fixture {
    summaries: Vec<Summary>,
    pairs: Vec<Pair>,
    orders: Vec<Orders>,
    crossed: Vec<Crossed>,
}

#[derive(Debug, Deserialize)]
struct Orders {
    a: Vec<f64>,
    b: Vec<f64>,
    tau: f64,
    p: f64,
}

/// A table of n rows and m columns: the sum of effects of rows, of columns and of cells, with the
/// 95 % interval of the mean, by numpy's resampling of rows and columns.
#[derive(Debug, Deserialize)]
struct Crossed {
    rows: Vec<Vec<f64>>,
    mean: f64,
    ci95: [f64; 2],
}

#[derive(Debug, Deserialize)]
struct Summary {
    values: Vec<f64>,
    median: f64,
    iqm: f64,
    /// The interval of the median.
    median_ci95: [f64; 2],
    iqm_ci95: [f64; 2],
}

#[derive(Debug, Deserialize)]
struct Pair {
    a: Vec<f64>,
    b: Vec<f64>,
    probability: f64,
    probability_ci95: [f64; 2],
    p: f64,
}

fn fixture() -> Fixture {
    serde_json::from_str(include_str!("../tests/fixtures/statistics.json")).unwrap()
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * expected.abs().max(1e-12)
}

/// Whether both ends agree, up to the effect of different random draws: a part of the width, or one
/// step between the possible values of a statistic that has few.
fn agree(found: Interval, expected: [f64; 2], part: f64) -> bool {
    let width = (expected[1] - expected[0]).abs().max(1e-12);
    found.ci95.unwrap().iter().zip(expected).all(|(found, end)| (found - end).abs() <= part * width)
}

#[test]
fn summaries_agree_with_rliable() {
    for of in fixture().summaries {
        let iqm = interval(&of.values, interquartile_mean);
        let middle = interval(&of.values, median);
        assert!(close(iqm.value, of.iqm, 1e-12), "{of:?} {iqm:?}");
        assert!(close(middle.value, of.median, 1e-12), "{of:?} {middle:?}");
        assert!(agree(iqm, of.iqm_ci95, 0.06), "{of:?} {iqm:?}");
        assert!(agree(middle, of.median_ci95, 0.12), "{of:?} {middle:?}");
    }
}

#[test]
fn comparisons_agree_with_rliable_and_scipy() {
    for pair in fixture().pairs {
        let found = interval_of_two(&pair.a, &pair.b, |a, b| probability_of_improvement(a, b));
        assert!(close(found.value, pair.probability, 1e-12), "{pair:?} {found:?}");
        assert!(agree(found, pair.probability_ci95, 0.12), "{pair:?} {found:?}");
        let p = mann_whitney(&pair.a, &pair.b).unwrap();
        assert!(close(p, pair.p, 1e-9), "{pair:?} {p}");
        assert_eq!(mann_whitney(&pair.b, &pair.a), Some(p));
    }
}

#[test]
fn orders_agree_as_in_scipy() {
    for of in fixture().orders {
        let found = kendall(&of.a, &of.b).unwrap();
        assert!(close(found.tau, of.tau, 1e-12) && close(found.p, of.p, 1e-9), "{of:?} {found:?}");
        assert_eq!(kendall(&of.b, &of.a), Some(found));
    }
}

#[test]
fn without_an_order_there_is_no_tau() {
    for (a, b) in [(vec![], vec![]), (vec![1.0], vec![2.0]), (vec![1.0, 2.0], vec![3.0, 3.0])] {
        assert_eq!(kendall(&a, &b), None);
    }
    let two = kendall(&[1.0, 2.0], &[4.0, 3.0]).unwrap();
    assert_eq!((two.tau, two.p), (-1.0, 1.0));
}

#[test]
fn crossed_samples_have_the_interval_of_numpy() {
    for of in fixture().crossed {
        let found = interval_of_crossed(&of.rows);
        assert!(close(found.value, of.mean, 1e-12) && agree(found, of.ci95, 0.06), "{found:?}");
        assert_eq!(interval_of_crossed(&of.rows[..2]).ci95, None);
    }
    assert_eq!(interval_of_crossed(&vec![vec![2.0; 4]; 4]).ci95, Some([2.0; 2]));
}

#[test]
fn events_that_never_happened_give_infinite_medians_and_ends() {
    let never = f64::INFINITY;
    let found = interval(&[3.0, 5.0, never], median);
    assert_eq!((found.value, found.ci95), (5.0, Some([3.0, never])));
    assert_eq!(median(&mut [3.0, never]), never);
    assert_eq!(median(&mut [never, never]), never);
}

#[test]
fn one_or_two_runs_have_no_interval_and_no_runs_have_no_value() {
    assert_eq!(interval(&[2.0], median), Interval { value: 2.0, ci95: None });
    assert_eq!(interval(&[2.0, 4.0], median).ci95, None);
    let better = |few: &[f64]| {
        interval_of_two(&[1.0, 2.0, 3.0], few, |a, b| probability_of_improvement(a, b))
    };
    assert_eq!(better(&[0.0, 0.0]).ci95, None);
    assert_eq!(better(&[0.0, 0.0, 0.0]).ci95, Some([1.0, 1.0]));
    assert!(interval(&[], median).value.is_nan());
    assert_eq!(mann_whitney(&[], &[1.0]), None);
    assert_eq!(mann_whitney(&[1.0], &[1.0]), Some(1.0));
}

#[test]
fn huge_and_tiny_values_have_finite_summaries() {
    for values in [[f64::MIN, f64::MAX, f64::MAX, 1e308], [5e-324, 1e-323, 0.0, -5e-324]] {
        for found in [interval(&values, median), interval(&values, interquartile_mean)] {
            let [low, high] = found.ci95.unwrap();
            assert!(found.value.is_finite() && low.is_finite() && high.is_finite(), "{found:?}");
        }
    }
}

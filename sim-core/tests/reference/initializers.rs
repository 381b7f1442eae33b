//! Start values (section 5 of the simulation's specification).

use std::f64::consts::TAU;

use determinism::random::Stream;
use experiment_file::Initializer;

use super::torus::{Torus, Vector, norm, wrap_angle};

const STEP_CM: f64 = 80.0;
const LEAST_DISTANCE_CM: f64 = 40.0;
const LARGEST_NEAREST_DISTANCE_CM: f64 = 99.0;

/// Positions of `n` instances, drawn in order.
pub fn positions(
    initializer: &Initializer,
    n: u32,
    torus: Torus,
    stream: &mut Stream,
) -> Vec<Vector> {
    match initializer {
        Initializer::Fixed { values } => (0..n as usize)
            .map(|i| one_for_all_or_each(values, i))
            .map(|p| torus.wrap([p[0], p[1]]))
            .collect(),
        &Initializer::RandomUniform { low, high, size } => {
            assert_eq!(size, 2, "a position has two components");
            (0..n)
                .map(|_| {
                    let x = low + (high - low) * stream.uniform();
                    let y = low + (high - low) * stream.uniform();
                    torus.wrap([x, y])
                })
                .collect()
        }
        &Initializer::RandomCircumference { radius, center } => (0..n)
            .map(|_| {
                let angle = TAU * stream.uniform();
                torus.wrap([center[0] + radius * angle.cos(), center[1] + radius * angle.sin()])
            })
            .collect(),
        &Initializer::RandomGraph { max_rad, initial_pos } => {
            random_graph(max_rad, initial_pos, n, torus, stream)
        }
    }
}

/// Headings of `n` instances, drawn in order.
pub fn headings(initializer: &Initializer, n: u32, stream: &mut Stream) -> Vec<f64> {
    match initializer {
        Initializer::Fixed { values } => {
            (0..n as usize).map(|i| wrap_angle(one_for_all_or_each(values, i)[0])).collect()
        }
        &Initializer::RandomUniform { low, high, size } => {
            assert_eq!(size, 1, "a heading has one component");
            (0..n).map(|_| wrap_angle(low + (high - low) * stream.uniform())).collect()
        }
        Initializer::RandomCircumference { .. } | Initializer::RandomGraph { .. } => {
            panic!("draws positions, not headings")
        }
    }
}

fn one_for_all_or_each(values: &[Vec<f64>], i: usize) -> &[f64] {
    if values.len() == 1 { &values[0] } else { &values[i] }
}

/// Robots placed one by one, each at last + 80 cm * N(m, S): m = tanh(-D^3) per
/// axis with D = (last - centre) / max_rad; S has the variances sin^2 a, cos^2 a
/// (1, 1 while |D| <= 1/2) and the covariance 0.5 sin^3(2a) times their product,
/// a being the angle of D.
fn random_graph(
    max_rad: f64,
    centre: Vector,
    n: u32,
    torus: Torus,
    stream: &mut Stream,
) -> Vec<Vector> {
    let mut placed = vec![torus.wrap(centre)];
    while placed.len() < n as usize {
        let last = placed[placed.len() - 1];
        let from_centre = torus.displacement(centre, last);
        let d = [from_centre[0] / max_rad, from_centre[1] / max_rad];
        let a = d[1].atan2(d[0]);
        let mean = [(-d[0].powi(3)).tanh(), (-d[1].powi(3)).tanh()];
        let [var_x, var_y] =
            if norm(d) > 0.5 { [a.sin().powi(2), a.cos().powi(2)] } else { [1.0, 1.0] };
        let covariance = 0.5 * (2.0 * a).sin().powi(3) * var_x * var_y;
        let [l11, l21, l22] = cholesky(var_x, covariance, var_y);
        let stands = |candidate: Vector| {
            let nearest = placed
                .iter()
                .map(|&other| torus.distance(candidate, other))
                .fold(f64::INFINITY, f64::min);
            (LEAST_DISTANCE_CM..=LARGEST_NEAREST_DISTANCE_CM).contains(&nearest)
        };
        let candidate = loop {
            let z1 = stream.normal();
            let z2 = stream.normal();
            let step = [mean[0] + l11 * z1, mean[1] + l21 * z1 + l22 * z2];
            let candidate = torus.wrap([last[0] + STEP_CM * step[0], last[1] + STEP_CM * step[1]]);
            if stands(candidate) {
                break candidate;
            }
        };
        placed.push(candidate);
    }
    placed
}

/// Lower factor (l11, l21, l22) of a 2 x 2 covariance matrix.
fn cholesky(var_x: f64, covariance: f64, var_y: f64) -> [f64; 3] {
    if var_x == 0.0 {
        return [0.0, 0.0, var_y.sqrt()];
    }
    let l11 = var_x.sqrt();
    let l21 = covariance / l11;
    [l11, l21, (var_y - l21 * l21).sqrt()]
}

/// Section 5's measurements of the original: degree, distance to the nearest
/// robot, extent, share on the alpha shape; each within 10 %.
#[test]
fn random_graphs_have_the_measured_statistics() {
    use super::alpha_shape::borderline;
    use determinism::random::Purpose;

    const N_SAMPLES: u64 = 200;
    let torus = Torus { width: 1000.0, height: 1000.0 };
    for (n, targets) in [
        (10, [3.88, 54.8, 201.0, 0.83]),
        (20, [5.48, 50.6, 287.0, 0.61]),
        (30, [6.39, 49.4, 347.0, 0.50]),
    ] {
        let mut sums = [0.0; 4];
        for trial in 0..N_SAMPLES {
            let mut stream = Stream::new(0, 0, trial, Purpose::Positions, 0);
            let graph = random_graph(100.0, [500.0, 500.0], n, torus, &mut stream);
            for &a in &graph {
                let distances = || {
                    graph.iter().map(|&b| torus.distance(a, b)).filter(|&distance| distance > 0.0)
                };
                sums[0] += distances().filter(|&distance| distance < 100.0).count() as f64;
                sums[1] += distances().fold(f64::INFINITY, f64::min);
            }
            for axis in [0, 1] {
                let low = graph.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
                let high = graph.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
                sums[2] += f64::from(n) * (high - low) / 2.0;
            }
            let is_border = borderline(&graph, torus, 100.0, 1000.0 / 15.0);
            sums[3] += is_border.iter().filter(|&&is_border| is_border).count() as f64;
        }
        let measured = sums.map(|sum| sum / (f64::from(n) * N_SAMPLES as f64));
        for (measured, target) in measured.into_iter().zip(targets) {
            assert!((measured / target - 1.0).abs() < 0.1, "{n} robots: {measured}, {target}");
        }
    }
}

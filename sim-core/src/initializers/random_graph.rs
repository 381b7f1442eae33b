//! `random_graph`: a connected, compact random geometric graph, grown one robot at a time. Far from
//! the centre, steps become tangential and lead back.

use super::Unplaceable;
use crate::torus::{Torus, Vec2};
use determinism::random::Stream;

/// Scale of a step, cm.
const STEP: f64 = 80.0;
/// Least distance between two robots, cm.
const MIN_DISTANCE: f64 = 40.0;
/// Largest distance to the nearest robot, cm.
const MAX_DISTANCE: f64 = 99.0;
/// Most candidates per robot.
const MAX_ATTEMPTS: usize = 10_000;

/// Places `n` robots, the first at `initial`, which is also the centre.
pub(super) fn draw(
    max_rad: f64,
    initial: Vec2,
    n: usize,
    torus: &Torus,
    stream: &mut Stream,
) -> Result<Vec<Vec2>, Unplaceable> {
    let center = torus.wrap(initial);
    let mut placed = Vec::with_capacity(n);
    let mut last = center;
    for index in 0..n {
        if index > 0 {
            let way = torus.displacement(center, last);
            let step = Step::new(Vec2 { x: way.x / max_rad, y: way.y / max_rad });
            let mut candidates = (0..MAX_ATTEMPTS).map(|_| {
                let step = step.draw(stream);
                torus.wrap(Vec2 { x: last.x + step.x, y: last.y + step.y })
            });
            last = candidates
                .find(|&candidate| stands(candidate, &placed, torus))
                .ok_or(Unplaceable { index })?;
        }
        placed.push(last);
    }
    Ok(placed)
}

/// Distribution of the next step: STEP * N(mean, L L').
struct Step {
    mean: Vec2,
    l_xx: f64,
    l_yx: f64,
    l_yy: f64,
}

impl Step {
    /// `d`: displacement from the centre to the last robot, in units of `max_rad`.
    fn new(d: Vec2) -> Self {
        let angle = libm::atan2(d.y, d.x);
        let (sin, cos) = libm::sincos(angle);
        let (var_x, var_y) = if d.norm() > 0.5 { (sin * sin, cos * cos) } else { (1.0, 1.0) };
        let twist = libm::sin(2.0 * angle);
        let covariance = 0.5 * (twist * twist * twist) * var_x * var_y;
        let l_xx = var_x.sqrt();
        let l_yx = if l_xx > 0.0 { covariance / l_xx } else { 0.0 };
        Self {
            mean: Vec2 { x: libm::tanh(-(d.x * d.x * d.x)), y: libm::tanh(-(d.y * d.y * d.y)) },
            l_xx,
            l_yx,
            // At most a quarter of the variance is shared with x.
            l_yy: (var_y - l_yx * l_yx).sqrt(),
        }
    }

    fn draw(&self, stream: &mut Stream) -> Vec2 {
        let z1 = stream.normal();
        let z2 = stream.normal();
        Vec2 {
            x: STEP * (self.mean.x + self.l_xx * z1),
            y: STEP * (self.mean.y + (self.l_yx * z1 + self.l_yy * z2)),
        }
    }
}

/// Whether a candidate is far enough from every robot, and near enough to one.
fn stands(candidate: Vec2, placed: &[Vec2], torus: &Torus) -> bool {
    let distances = placed.iter().map(|&robot| torus.distance(robot, candidate));
    let nearest = distances.fold(f64::INFINITY, f64::min);
    (MIN_DISTANCE..=MAX_DISTANCE).contains(&nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use determinism::random::Purpose;

    const TORUS: Torus = Torus::new(1000.0, 1000.0);

    fn graph(n: usize, trial: u64) -> Vec<Vec2> {
        let mut stream = Stream::new(0, 0, trial, Purpose::Positions, 0);
        draw(100.0, Vec2::new(500.0, 500.0), n, &TORUS, &mut stream).unwrap()
    }

    /// Mean degree, mean nearest-neighbour distance, mean extent per axis.
    fn statistics(graph: &[Vec2]) -> [f64; 3] {
        let n = graph.len() as f64;
        let distances = |&a: &Vec2| {
            let others = graph.iter().filter(move |&&b| a != b);
            others.map(move |&b| TORUS.distance(a, b))
        };
        let degree = graph.iter().flat_map(distances).filter(|&d| d < 100.0).count() as f64 / n;
        let nearest = graph.iter().map(|a| distances(a).fold(f64::INFINITY, f64::min)).sum::<f64>();
        let extent = |axis: fn(Vec2) -> f64| {
            let ways = graph.iter().map(|&p| axis(TORUS.displacement(graph[0], p)));
            ways.clone().fold(f64::MIN, f64::max) - ways.fold(f64::MAX, f64::min)
        };
        [degree, nearest / n, 0.5 * (extent(|p| p.x) + extent(|p| p.y))]
    }

    #[test]
    fn graphs_have_the_statistics_of_the_original() {
        const N_SAMPLES: u64 = 200;
        for (n, expected) in
            [(10, [3.88, 54.8, 201.0]), (20, [5.48, 50.6, 287.0]), (30, [6.39, 49.4, 347.0])]
        {
            let mut means = [0.0; 3];
            for trial in 0..N_SAMPLES {
                for (mean, value) in means.iter_mut().zip(statistics(&graph(n, trial))) {
                    *mean += value / N_SAMPLES as f64;
                }
            }
            eprintln!("{n} robots: {means:?}, expected {expected:?}");
            for (mean, expected) in means.iter().zip(expected) {
                assert!((mean / expected - 1.0).abs() < 0.1, "{n} robots: {means:?}");
            }
        }
    }

    #[test]
    fn graphs_are_connected() {
        for trial in 0..50 {
            let graph = graph(20, trial);
            let mut reached = vec![graph[0]];
            let mut next = 0;
            while next < reached.len() {
                let near = |p: &&Vec2| TORUS.distance(**p, reached[next]) < 100.0;
                let new: Vec<Vec2> =
                    graph.iter().filter(near).filter(|p| !reached.contains(p)).copied().collect();
                reached.extend(new);
                next += 1;
            }
            assert_eq!(reached.len(), 20);
        }
    }

    #[test]
    fn a_full_world_is_an_error() {
        let small = Torus::new(100.0, 100.0);
        let mut stream = Stream::new(0, 0, 0, Purpose::Positions, 0);
        let result = draw(100.0, Vec2::new(50.0, 50.0), 20, &small, &mut stream);
        assert!(matches!(result, Err(Unplaceable { index }) if index > 1), "{result:?}");
    }
}

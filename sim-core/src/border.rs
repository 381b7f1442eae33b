//! Finds the robots at the border of their swarm (section 5.2 of the thesis).

use crate::alpha_shape;
use crate::torus::{Torus, Vec2};

/// Number of robots below which a component has no interior.
const MIN_WITH_INTERIOR: usize = 4;

/// Whether each robot lies on the outer border of the alpha shape of its component; robots less
/// than `range` apart are connected. `alpha`: in units of 1 / world width.
pub(crate) fn of_swarm(torus: &Torus, positions: &[Vec2], range: f64, alpha: f64) -> Vec<bool> {
    let mut border = vec![true; positions.len()];
    let mut seen = vec![false; positions.len()];
    for first in 0..positions.len() {
        if seen[first] {
            continue;
        }
        let component = unwrap(torus, positions, range, first, &mut seen);
        if component.len() < MIN_WITH_INTERIOR {
            continue;
        }
        let points: Vec<Vec2> = component.iter().map(|&(_, point)| point).collect();
        let on_border = alpha_shape::border(&points, torus.width / alpha);
        for (&(robot, _), on_border) in component.iter().zip(on_border) {
            border[robot] = on_border;
        }
    }
    border
}

/// The component of `first`, each robot with its position in the plane relative to `first`.
/// Positions are sums of displacements along edges, so a component that straddles the seam of the
/// torus stays in one piece.
fn unwrap(
    torus: &Torus,
    positions: &[Vec2],
    range: f64,
    first: usize,
    seen: &mut [bool],
) -> Vec<(usize, Vec2)> {
    seen[first] = true;
    let mut component = vec![(first, Vec2::default())];
    let mut next = 0;
    while let Some(&(robot, at)) = component.get(next) {
        next += 1;
        for (other, &position) in positions.iter().enumerate() {
            let way = torus.displacement(positions[robot], position);
            if !seen[other] && way.norm() < range {
                seen[other] = true;
                component.push((other, Vec2 { x: at.x + way.x, y: at.y + way.y }));
            }
        }
    }
    component
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::initializers::Positions;
    use determinism::random::{Purpose, Stream};
    use experiment_file::Initializer;

    const TORUS: Torus = Torus::new(1000.0, 1000.0);

    fn border(positions: &[(f64, f64)]) -> Vec<bool> {
        let positions: Vec<Vec2> =
            positions.iter().map(|&(x, y)| TORUS.wrap(Vec2::new(x, y))).collect();
        of_swarm(&TORUS, &positions, 100.0, 15.0)
    }

    #[test]
    fn every_component_has_its_own_border() {
        let square = |x: f64, y: f64| {
            [(x, y), (x + 80.0, y), (x + 80.0, y + 80.0), (x, y + 80.0), (x + 41.0, y + 40.0)]
        };
        let mut robots = square(100.0, 100.0).to_vec();
        robots.extend(square(500.0, 500.0));
        robots.extend([(800.0, 100.0), (850.0, 100.0), (825.0, 101.0)]);
        let border = border(&robots);
        let interior: Vec<usize> = (0..robots.len()).filter(|&robot| !border[robot]).collect();
        assert_eq!(interior, [4, 9]);
    }

    #[test]
    fn three_robots_and_a_line_are_all_border() {
        assert_eq!(border(&[(0.0, 0.0), (60.0, 0.0), (30.0, 1.0)]), [true; 3]);
        assert_eq!(border(&[(0.0, 0.0), (60.0, 0.0), (120.0, 0.0), (180.0, 0.0)]), [true; 4]);
        assert_eq!(border(&[(5.0, 5.0); 6]), [true; 6]);
        assert_eq!(border(&[]), [false; 0]);
    }

    fn graph(n: usize, trial: u64) -> Vec<Vec2> {
        let config = Initializer::RandomGraph { max_rad: 100.0, initial_pos: [500.0, 500.0] };
        let mut stream = Stream::new(0, 0, trial, Purpose::Positions, 0);
        Positions::new(&config, n).unwrap().draw(&TORUS, &mut stream).unwrap()
    }

    proptest! {
        #[test]
        fn borders_do_not_depend_on_where_the_swarm_is(
            trial in 0..200u64, x in 0.0..1000.0f64, y in 0.0..1000.0f64,
        ) {
            let robots = graph(20, trial);
            let moved: Vec<Vec2> =
                robots.iter().map(|p| TORUS.wrap(Vec2::new(p.x + x, p.y + y))).collect();
            prop_assert_eq!(of_swarm(&TORUS, &robots, 100.0, 15.0), of_swarm(&TORUS, &moved, 100.0, 15.0));
        }
    }

    #[test]
    fn random_graphs_have_the_share_of_border_robots_of_the_original() {
        const N_SAMPLES: u64 = 200;
        for (n, expected) in [(10, 0.83), (20, 0.61), (30, 0.50)] {
            let share = |trial| {
                let border = of_swarm(&TORUS, &graph(n, trial), 100.0, 15.0);
                border.iter().filter(|on_border| **on_border).count() as f64 / n as f64
            };
            let mean = (0..N_SAMPLES).map(share).sum::<f64>() / N_SAMPLES as f64;
            assert!((mean / expected - 1.0).abs() < 0.1, "{n} robots: {mean}");
        }
    }
}

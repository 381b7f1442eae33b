//! Which robots are near each other, how far and in which direction. It depends
//! on positions alone, so it is computed again only when a robot has moved.

use std::f64::consts::PI;

use crate::torus::{Torus, Vec2, wrap_angle};

/// Swarms up to this size are searched pair by pair.
const MAX_SEARCHED_BY_PAIRS: usize = 64;
/// Cells per axis, at most: memory, not speed.
const MAX_CELLS: usize = 256;

/// A robot as another one has it nearby.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbour {
    /// The robot.
    pub robot: usize,
    /// Its distance, cm.
    pub rho: f64,
    /// Its direction in the world's frame, in \[0, 2 pi).
    pub bearing: f64,
}

impl Neighbour {
    /// Direction from it to the other robot.
    pub fn reverse_bearing(&self) -> f64 {
        // No direction leads from a point to itself; both see it at 0.
        if self.rho == 0.0 { self.bearing } else { wrap_angle(self.bearing + PI) }
    }
}

/// The neighbours of every robot.
#[derive(Debug, Clone)]
pub(crate) struct Neighbours {
    /// Distance within which robots are neighbours, cm.
    reach: f64,
    /// Per robot, by their indices.
    of: Vec<Vec<Neighbour>>,
    /// Robots per cell of a grid; empty for small swarms.
    cells: Vec<Vec<usize>>,
}

impl Neighbours {
    /// Before the first [`update`](Self::update): no robot has a neighbour.
    pub fn new(reach: f64, n_robots: usize) -> Self {
        Self { reach, of: vec![Vec::new(); n_robots], cells: Vec::new() }
    }

    /// The neighbours of a robot, by their indices.
    pub fn of(&self, robot: usize) -> &[Neighbour] {
        &self.of[robot]
    }

    /// Finds everybody's neighbours.
    pub fn update(&mut self, torus: &Torus, positions: &[Vec2]) {
        self.of.iter_mut().for_each(Vec::clear);
        if self.reach == 0.0 {
            return; // no robot senses another one
        }
        let n_columns = n_cells(torus.width, self.reach);
        let n_rows = n_cells(torus.height, self.reach);
        // With fewer than three cells, left and right neighbours are the same.
        if positions.len() <= MAX_SEARCHED_BY_PAIRS || n_columns < 3 || n_rows < 3 {
            for second in 1..positions.len() {
                for first in 0..second {
                    self.examine(torus, positions, first, second);
                }
            }
        } else {
            self.search_grid(torus, positions, n_columns, n_rows);
        }
    }

    /// As above, but looks only into the cells around each robot's own.
    fn search_grid(&mut self, torus: &Torus, positions: &[Vec2], n_columns: usize, n_rows: usize) {
        let mut cells = std::mem::take(&mut self.cells);
        cells.resize(n_columns * n_rows, Vec::new());
        cells.iter_mut().for_each(Vec::clear);
        let cell_of = |position: Vec2| {
            let column = (position.x / torus.width * n_columns as f64) as usize;
            let row = (position.y / torus.height * n_rows as f64) as usize;
            (column.min(n_columns - 1), row.min(n_rows - 1))
        };
        for (robot, &position) in positions.iter().enumerate() {
            let (column, row) = cell_of(position);
            for row in [row + n_rows - 1, row, row + 1] {
                for column in [column + n_columns - 1, column, column + 1] {
                    // So far, cells hold robots of lower indices.
                    for &other in &cells[row % n_rows * n_columns + column % n_columns] {
                        self.examine(torus, positions, other, robot);
                    }
                }
            }
            cells[row * n_columns + column].push(robot);
        }
        for neighbours in &mut self.of {
            neighbours.sort_unstable_by_key(|neighbour| neighbour.robot);
        }
        self.cells = cells;
    }

    /// Makes two robots each other's neighbours if they are near enough.
    fn examine(&mut self, torus: &Torus, positions: &[Vec2], first: usize, second: usize) {
        let away = torus.displacement(positions[first], positions[second]);
        let rho = away.norm();
        if rho <= self.reach {
            let seen = Neighbour { robot: second, rho, bearing: away.angle() };
            let back = Neighbour { robot: first, rho, bearing: seen.reverse_bearing() };
            self.of[first].push(seen);
            self.of[second].push(back);
        }
    }
}

/// Number of cells along an axis, none shorter than `reach`.
fn n_cells(extent: f64, reach: f64) -> usize {
    // Rounding must not make a cell shorter than the reach.
    ((extent / reach * (1.0 - 1e-9)) as usize).min(MAX_CELLS)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TORUS: Torus = Torus { width: 1000.0, height: 600.0 };

    fn neighbours(positions: &[Vec2], reach: f64) -> Neighbours {
        let mut neighbours = Neighbours::new(reach, positions.len());
        neighbours.update(&TORUS, positions);
        neighbours
    }

    #[test]
    fn neighbours_see_each_other_across_the_seam() {
        let positions = [Vec2::new(990.0, 10.0), Vec2::new(20.0, 570.0), Vec2::new(500.0, 300.0)];
        let neighbours = neighbours(&positions, 50.0);
        let [seen] = neighbours.of(0) else { panic!("one neighbour") };
        assert_eq!((seen.robot, seen.rho), (1, 50.0));
        assert!((seen.bearing - wrap_angle(libm::atan2(-40.0, 30.0))).abs() < 1e-15);
        let [back] = neighbours.of(1) else { panic!("one neighbour") };
        assert!((back.bearing - libm::atan2(40.0, -30.0)).abs() < 1e-15);
        assert!((back.reverse_bearing() - seen.bearing).abs() < 1e-15);
        assert!(neighbours.of(2).is_empty());
    }

    #[test]
    fn robots_at_one_point_see_each_other_at_0() {
        let neighbours = neighbours(&[Vec2::new(1.0, 1.0); 2], 50.0);
        let at = |robot| Neighbour { robot, rho: 0.0, bearing: 0.0 };
        assert_eq!((neighbours.of(0), neighbours.of(1)), (&[at(1)][..], &[at(0)][..]));
        assert_eq!(at(1).reverse_bearing(), 0.0);
    }

    proptest! {
        #[test]
        fn everybody_within_reach_is_found_once_and_in_order(
            points in prop::collection::vec((0.0..1000.0, 0.0..600.0), 0..200),
            reach in prop::sample::select(vec![1.0, 40.0, 199.9, 200.0, 250.0, 2000.0]),
        ) {
            let positions: Vec<Vec2> = points.into_iter().map(|(x, y)| Vec2::new(x, y)).collect();
            let neighbours = neighbours(&positions, reach);
            for (robot, &position) in positions.iter().enumerate() {
                let found: Vec<usize> = neighbours.of(robot).iter().map(|n| n.robot).collect();
                let others = (0..positions.len()).filter(|&other| {
                    other != robot && TORUS.distance(position, positions[other]) <= reach
                });
                prop_assert_eq!(found, others.collect::<Vec<_>>());
            }
        }
    }
}

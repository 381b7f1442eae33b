//! Finds robots that are near each other, with distances and directions. They depend only on
//! positions, so they are recomputed only after a robot has moved.

use std::f64::consts::PI;
use std::ops::Range;

use determinism::simd::{Simd, WithSimd};

use crate::polar;
use crate::torus::{Torus, Vec2, wrap_angle};
use determinism::Isa;

/// Largest swarm that is searched without a grid. In a larger one, most robots are far apart, and to
/// compare all of them takes longer than to sort them.
const MAX_WITHOUT_GRID: usize = 32;
/// Number of robots to process together, few enough for their scratch data to stay in the cache.
const N_ROBOTS_AT_ONCE: usize = 128;
/// Most cells per robot. The number is limited because every step visits all cells, occupied or
/// not.
const MAX_CELLS_PER_ROBOT: usize = 16;
/// Most cells per axis, to limit memory.
const MAX_CELLS: usize = 512;

/// A neighbour of a robot.
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
    /// Direction from the neighbour to the robot.
    pub fn reverse_bearing(&self) -> f64 {
        // At the same point, both robots see each other in direction 0.
        if self.rho == 0.0 { self.bearing } else { wrap_angle(self.bearing + PI) }
    }
}

/// The neighbours of every robot, robot by robot; the neighbours of one robot are in no
/// particular order.
#[derive(Debug, Clone)]
pub(crate) struct Neighbours {
    /// Distance within which robots are neighbours, cm.
    reach: f64,
    /// The largest squared distance of neighbours.
    reach_squared: f64,
    found: Found,
    grid: Grid,
}

/// The lists of neighbours. They may have spare room.
#[derive(Debug, Clone, Default)]
struct Found {
    /// Index of each robot's first neighbour, and the end.
    first: Vec<usize>,
    /// The neighbours' numbers.
    robots: Vec<u32>,
    /// The neighbours' distances, cm.
    rho: Vec<f64>,
    /// Their directions in the world's frame, in \[0, 2 pi).
    bearing: Vec<f64>,
    /// Scratch: displacements to the neighbours found last, cm.
    away_x: Vec<f64>,
    away_y: Vec<f64>,
}

impl Neighbours {
    /// The state before the first [`update`](Self::update), in which no robot has a neighbour.
    pub fn new(reach: f64, n_robots: usize) -> Self {
        let first = vec![0; n_robots + 1];
        let found = Found { first, ..Found::default() };
        Self { reach, reach_squared: largest_square(reach), found, grid: Grid::default() }
    }

    /// Range of a robot's neighbours in the lists.
    pub fn places(&self, robot: usize) -> Range<usize> {
        self.found.first[robot]..self.found.first[robot + 1]
    }

    /// The neighbour at an index.
    pub fn get(&self, place: usize) -> Neighbour {
        Neighbour {
            robot: self.found.robots[place] as usize,
            rho: self.found.rho[place],
            bearing: self.found.bearing[place],
        }
    }

    /// The neighbours of a robot.
    pub fn of_robot(&self, robot: usize) -> impl Iterator<Item = Neighbour> {
        self.places(robot).map(|place| self.get(place))
    }

    /// Numbers of the neighbours in a range.
    pub fn robots(&self, places: Range<usize>) -> &[u32] {
        &self.found.robots[places]
    }

    /// Directions of the neighbours in a range.
    pub fn bearings(&self, places: Range<usize>) -> &[f64] {
        &self.found.bearing[places]
    }

    /// Distances of the neighbours in a range.
    pub fn distances(&self, places: Range<usize>) -> &[f64] {
        &self.found.rho[places]
    }

    /// Keeps those neighbours of each robot for which `keep` is true.
    pub fn retain(&mut self, mut keep: impl FnMut(usize, Neighbour) -> bool) {
        let n_robots = self.found.first.len() - 1;
        let mut kept = 0;
        for robot in 0..n_robots {
            let places = self.places(robot);
            self.found.first[robot] = kept;
            for place in places {
                if keep(robot, self.get(place)) {
                    let Found { robots, rho, bearing, .. } = &mut self.found;
                    robots[kept] = robots[place];
                    (rho[kept], bearing[kept]) = (rho[place], bearing[place]);
                    kept += 1;
                }
            }
        }
        self.found.first[n_robots] = kept;
    }

    /// Finds the neighbours of all robots.
    pub fn update(&mut self, torus: &Torus, positions: &[Vec2]) {
        if self.reach == 0.0 {
            return; // No robot senses another one.
        }
        let has_grid =
            positions.len() > MAX_WITHOUT_GRID && self.grid.sort(torus, self.reach, positions);
        if !has_grid {
            self.grid.keep(positions);
        }
        let Self { reach_squared, found, grid, .. } = self;
        let grid = &*grid;
        let reach_squared = *reach_squared;
        for start in (0..positions.len()).step_by(N_ROBOTS_AT_ONCE) {
            let robots = start..positions.len().min(start + N_ROBOTS_AT_ONCE);
            let search = Search {
                torus,
                reach_squared,
                positions,
                robots: robots.clone(),
                grid,
                has_grid,
                found,
            };
            Isa::best().run(search);
            found.locate(robots);
        }
    }
}

/// The largest number whose square root is not above `reach`.
fn largest_square(reach: f64) -> f64 {
    let mut square = reach * reach;
    while square.sqrt() > reach {
        square = square.next_down();
    }
    while square.next_up().sqrt() <= reach {
        square = square.next_up();
    }
    square
}

/// The search for the neighbours of all robots.
struct Search<'a> {
    torus: &'a Torus,
    reach_squared: f64,
    positions: &'a [Vec2],
    /// The robots whose neighbours to find.
    robots: Range<usize>,
    grid: &'a Grid,
    has_grid: bool,
    found: &'a mut Found,
}

impl WithSimd for Search<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { torus, reach_squared, positions, robots, grid, has_grid, found } = self;
        let first = found.first[robots.start];
        let mut n_found = 0;
        for robot in robots {
            let from = positions[robot];
            let near = Near { torus, reach_squared, robot: robot as u32, from, first };
            if has_grid {
                for cells in grid.around(from) {
                    n_found = near.search(&grid.robots, cells, found, n_found);
                }
            } else {
                n_found = near.search(&grid.robots, 0..positions.len(), found, n_found);
            }
            found.first[robot + 1] = first + n_found;
        }
    }
}

impl Found {
    /// Makes room for `n` neighbours, of which `n_new` are not located yet.
    fn make_room(&mut self, n: usize, n_new: usize) {
        self.robots.resize(n.max(self.robots.len()), 0);
        self.away_x.resize(n_new.max(self.away_x.len()), 0.0);
        self.away_y.resize(n_new.max(self.away_y.len()), 0.0);
    }

    /// Computes distances and directions of the neighbours of some robots.
    fn locate(&mut self, robots: Range<usize>) {
        let places = self.first[robots.start]..self.first[robots.end];
        self.rho.resize(self.robots.len(), 0.0);
        self.bearing.resize(self.robots.len(), 0.0);
        let (x, y) = (&self.away_x[..places.len()], &self.away_y[..places.len()]);
        polar::complete(x, y, &mut self.rho[places.clone()], &mut self.bearing[places]);
    }
}

/// The neighbours of one robot during the search.
struct Near<'a> {
    torus: &'a Torus,
    reach_squared: f64,
    robot: u32,
    from: Vec2,
    /// Index of the first neighbour that is not located yet.
    first: usize,
}

/// Number of robots to compare at once: the longest vector holds this many numbers.
const N_AT_ONCE: usize = 8;

impl Near<'_> {
    /// Writes the near robots of a range after the `n_found` neighbours that are not located yet;
    /// returns the new number of these.
    ///
    /// The outcome is unpredictable, so the code has no branch: it writes every robot, and then
    /// overwrites a robot that is not near with the next robot.
    #[inline(always)]
    fn search(
        &self,
        others: &Placed,
        range: Range<usize>,
        found: &mut Found,
        mut n_found: usize,
    ) -> usize {
        let Self { torus, reach_squared, robot, from, first } = *self;
        let n_then = n_found + range.len();
        if found.robots.len() < first + n_then || found.away_x.len() < n_then {
            found.make_room(2 * (first + n_then), 2 * n_then);
        }
        for start in range.clone().step_by(N_AT_ONCE) {
            let places = start..start + N_AT_ONCE;
            let (xs, ys) = (&others.x[places.clone()], &others.y[places.clone()]);
            let (mut away_x, mut away_y) = ([0.0; N_AT_ONCE], [0.0; N_AT_ONCE]);
            let mut squares = [0.0; N_AT_ONCE];
            for i in 0..N_AT_ONCE {
                let away = torus.displacement(from, Vec2 { x: xs[i], y: ys[i] });
                (away_x[i], away_y[i]) = (away.x, away.y);
                squares[i] = away.x * away.x + away.y * away.y;
            }
            let robots = &others.robots[start..range.end.min(places.end)];
            for (i, &other) in robots.iter().enumerate() {
                found.robots[first + n_found] = other;
                found.away_x[n_found] = away_x[i];
                found.away_y[n_found] = away_y[i];
                n_found += usize::from((squares[i] <= reach_squared) & (other != robot));
            }
        }
        n_found
    }
}

/// Robots and their positions.
#[derive(Debug, Clone, Default)]
struct Placed {
    robots: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Placed {
    /// Resizes to `n` robots, with room to read the last robots in whole vectors.
    fn resize(&mut self, n: usize) {
        self.robots.resize(n, 0);
        self.x.resize(n + N_AT_ONCE, 0.0);
        self.y.resize(n + N_AT_ONCE, 0.0);
    }

    fn set(&mut self, index: usize, robot: usize, position: Vec2) {
        self.robots[index] = robot as u32;
        (self.x[index], self.y[index]) = (position.x, position.y);
    }
}

/// Robots by cells of the plane.
#[derive(Debug, Clone, Default)]
struct Grid {
    n_columns: usize,
    n_rows: usize,
    columns_per_cm: f64,
    rows_per_cm: f64,
    /// The first robot of each cell, row by row, and the end.
    first: Vec<u32>,
    robots: Placed,
    /// Scratch: the cell of each robot.
    cells: Vec<u32>,
}

impl Grid {
    /// Sorts robots into cells no shorter than `reach`. Returns false if there are so few cells
    /// that left and right neighbours coincide.
    fn sort(&mut self, torus: &Torus, reach: f64, positions: &[Vec2]) -> bool {
        let n = |extent| n_cells(extent, reach, positions.len());
        (self.n_columns, self.n_rows) = (n(torus.width), n(torus.height));
        if self.n_columns < 3 || self.n_rows < 3 {
            return false;
        }
        self.columns_per_cm = self.n_columns as f64 / torus.width;
        self.rows_per_cm = self.n_rows as f64 / torus.height;
        let mut cells = std::mem::take(&mut self.cells);
        cells.clear();
        cells.extend(positions.iter().map(|&position| self.cell(position)));
        self.first.clear();
        self.first.resize(self.n_columns * self.n_rows + 1, 0);
        for &cell in &cells {
            self.first[cell as usize] += 1;
        }
        let mut n = 0;
        for first in &mut self.first {
            n += *first;
            *first = n;
        }
        self.robots.resize(positions.len());
        // Backwards, so that the robots of every cell stay in order.
        for (robot, (&position, &cell)) in positions.iter().zip(&cells).enumerate().rev() {
            let place = &mut self.first[cell as usize];
            *place -= 1;
            self.robots.set(*place as usize, robot, position);
        }
        self.cells = cells;
        true
    }

    /// Keeps the robots as they are.
    fn keep(&mut self, positions: &[Vec2]) {
        self.robots.resize(positions.len());
        for (robot, &position) in positions.iter().enumerate() {
            self.robots.set(robot, robot, position);
        }
    }

    /// Ranges of the robots in the cells around a position.
    #[inline(always)]
    fn around(&self, position: Vec2) -> [Range<usize>; 6] {
        let (column, row) = self.column_and_row(position);
        // Neighbouring cells of a row are adjacent in memory, except at the seam.
        let last = self.n_columns - 1;
        let (middle, beyond) = match column {
            0 => (0..2, last..last + 1),
            column if column == last => (last - 1..last + 1, 0..1),
            column => (column - 1..column + 2, 0..0),
        };
        let above = if row == 0 { self.n_rows - 1 } else { row - 1 };
        let below = if row + 1 == self.n_rows { 0 } else { row + 1 };
        let robots = |row: usize, columns: &Range<usize>| {
            let first = &self.first[row * self.n_columns..];
            first[columns.start] as usize..first[columns.end] as usize
        };
        [
            robots(above, &middle),
            robots(row, &middle),
            robots(below, &middle),
            robots(above, &beyond),
            robots(row, &beyond),
            robots(below, &beyond),
        ]
    }

    fn cell(&self, position: Vec2) -> u32 {
        let (column, row) = self.column_and_row(position);
        (row * self.n_columns + column) as u32
    }

    fn column_and_row(&self, position: Vec2) -> (usize, usize) {
        let column = (position.x * self.columns_per_cm) as usize;
        let row = (position.y * self.rows_per_cm) as usize;
        (column.min(self.n_columns - 1), row.min(self.n_rows - 1))
    }
}

/// Number of cells along an axis, none shorter than `reach`.
fn n_cells(extent: f64, reach: f64, n_robots: usize) -> usize {
    let most = (MAX_CELLS_PER_ROBOT * n_robots).isqrt().min(MAX_CELLS);
    // Rounding must not make a cell shorter than the reach.
    ((extent / reach * (1.0 - 1e-9)) as usize).min(most)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TORUS: Torus = Torus::new(1000.0, 600.0);

    fn neighbours(positions: &[Vec2], reach: f64) -> Neighbours {
        let mut neighbours = Neighbours::new(reach, positions.len());
        neighbours.update(&TORUS, positions);
        neighbours
    }

    #[test]
    fn neighbours_see_each_other_across_the_seam() {
        let positions = [Vec2::new(990.0, 10.0), Vec2::new(20.0, 570.0), Vec2::new(500.0, 300.0)];
        let neighbours = neighbours(&positions, 50.0);
        let [seen] = neighbours.of_robot(0).collect::<Vec<_>>()[..] else {
            panic!("one neighbour")
        };
        assert_eq!((seen.robot, seen.rho), (1, 50.0));
        assert!((seen.bearing - wrap_angle(libm::atan2(-40.0, 30.0))).abs() < 1e-15);
        let [back] = neighbours.of_robot(1).collect::<Vec<_>>()[..] else {
            panic!("one neighbour")
        };
        assert!((back.bearing - libm::atan2(40.0, -30.0)).abs() < 1e-15);
        assert!((back.reverse_bearing() - seen.bearing).abs() < 1e-15);
        assert_eq!(neighbours.of_robot(2).count(), 0);
    }

    #[test]
    fn robots_at_one_point_see_each_other_at_0() {
        let neighbours = neighbours(&[Vec2::new(1.0, 1.0); 2], 50.0);
        let at = |robot| Neighbour { robot, rho: 0.0, bearing: 0.0 };
        assert!(neighbours.of_robot(0).eq([at(1)]) && neighbours.of_robot(1).eq([at(0)]));
        assert_eq!(at(1).reverse_bearing(), 0.0);
    }

    proptest! {
        #[test]
        fn everybody_within_reach_is_found_once(
            points in prop::collection::vec((0.0..1000.0, 0.0..600.0), 0..200),
            reach in prop::sample::select(vec![1.0, 40.0, 199.9, 200.0, 250.0, 2000.0]),
        ) {
            let positions: Vec<Vec2> = points.into_iter().map(|(x, y)| Vec2::new(x, y)).collect();
            let neighbours = neighbours(&positions, reach);
            for (robot, &position) in positions.iter().enumerate() {
                let mut found: Vec<usize> = neighbours.of_robot(robot).map(|n| n.robot).collect();
                found.sort_unstable();
                let others = (0..positions.len()).filter(|&other| {
                    other != robot && TORUS.distance(position, positions[other]) <= reach
                });
                prop_assert_eq!(found, others.collect::<Vec<_>>());
            }
        }
    }
}

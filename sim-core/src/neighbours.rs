//! Which robots are near each other, how far and in which direction. It depends
//! on positions alone, so it is computed again only when a robot has moved.

use std::f64::consts::PI;
use std::ops::Range;

use crate::polar::{self, Polar};
use crate::torus::{Torus, Vec2, wrap_angle};

/// Swarms up to this size are searched without a grid.
const MAX_WITHOUT_GRID: usize = 64;
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

/// The neighbours of every robot, robot by robot, each one's by their indices.
#[derive(Debug, Clone)]
pub(crate) struct Neighbours {
    /// Distance within which robots are neighbours, cm.
    reach: f64,
    /// The first neighbour of each robot, and the end.
    first: Vec<usize>,
    /// Who they are.
    robots: Vec<u32>,
    /// Where they are.
    polar: Polar,
    grid: Grid,
    /// Scratch: those of one robot.
    found: Vec<Found>,
}

/// A neighbour of some robot.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    robot: u32,
    /// How it is displaced.
    away: Vec2,
    rho: f64,
}

impl Neighbours {
    /// Before the first [`update`](Self::update): no robot has a neighbour.
    pub fn new(reach: f64, n_robots: usize) -> Self {
        Self {
            reach,
            first: vec![0; n_robots + 1],
            robots: Vec::new(),
            polar: Polar::default(),
            grid: Grid::default(),
            found: Vec::new(),
        }
    }

    /// Places of a robot's neighbours.
    pub fn places(&self, robot: usize) -> Range<usize> {
        self.first[robot]..self.first[robot + 1]
    }

    /// The neighbour at a place.
    pub fn get(&self, place: usize) -> Neighbour {
        Neighbour {
            robot: self.robots[place] as usize,
            rho: self.polar.rho[place],
            bearing: self.polar.bearing[place],
        }
    }

    /// The neighbours of a robot, by their indices.
    pub fn of(&self, robot: usize) -> impl Iterator<Item = Neighbour> {
        self.places(robot).map(|place| self.get(place))
    }

    /// Directions of the neighbours at some places.
    pub fn bearings(&self, places: Range<usize>) -> &[f64] {
        &self.polar.bearing[places]
    }

    /// Distances of the neighbours at some places.
    pub fn distances(&self, places: Range<usize>) -> &[f64] {
        &self.polar.rho[places]
    }

    /// Finds everybody's neighbours.
    pub fn update(&mut self, torus: &Torus, positions: &[Vec2]) {
        if self.reach == 0.0 {
            return; // no robot senses another one
        }
        let n_robots = positions.len();
        let has_grid = n_robots > MAX_WITHOUT_GRID && self.grid.sort(torus, self.reach, positions);
        if !has_grid {
            self.grid.keep(positions);
        }
        let Self { reach, first, robots, polar: Polar { x, y, rho, .. }, grid, found } = self;
        robots.clear();
        x.clear();
        y.clear();
        rho.clear();
        for (robot, &from) in positions.iter().enumerate() {
            found.clear();
            if has_grid {
                for cells in grid.around(torus, from) {
                    search(torus, *reach, from, grid.robots.slice(cells), found);
                }
                found.sort_unstable_by_key(|found| found.robot);
            } else {
                search(torus, *reach, from, grid.robots.slice(0..n_robots), found);
            }
            for other in found.iter().filter(|other| other.robot as usize != robot) {
                robots.push(other.robot);
                x.push(other.away.x);
                y.push(other.away.y);
                rho.push(other.rho);
            }
            first[robot + 1] = robots.len();
        }
        polar::bearings(&mut self.polar);
    }
}

/// Robots and where they are.
#[derive(Debug, Clone, Default)]
struct Placed {
    robots: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// Some of them.
#[derive(Clone, Copy)]
struct PlacedSlice<'a> {
    robots: &'a [u32],
    x: &'a [f64],
    y: &'a [f64],
}

impl Placed {
    fn resize(&mut self, n: usize) {
        self.robots.resize(n, 0);
        self.x.resize(n, 0.0);
        self.y.resize(n, 0.0);
    }

    fn set(&mut self, index: usize, robot: usize, position: Vec2) {
        self.robots[index] = robot as u32;
        (self.x[index], self.y[index]) = (position.x, position.y);
    }

    fn slice(&self, range: Range<usize>) -> PlacedSlice<'_> {
        let Self { robots, x, y } = self;
        PlacedSlice { robots: &robots[range.clone()], x: &x[range.clone()], y: &y[range] }
    }
}

/// Adds those that are within `reach` of a position, which may be one of theirs.
///
/// Which ones are is not to be foreseen, so there is no branch: each is written down, and
/// the next one over it unless it is near.
fn search(torus: &Torus, reach: f64, from: Vec2, others: PlacedSlice<'_>, found: &mut Vec<Found>) {
    let mut n_found = found.len();
    found.resize(n_found + others.robots.len(), Found::default());
    for ((&robot, &x), &y) in others.robots.iter().zip(others.x).zip(others.y) {
        let away = torus.displacement(from, Vec2 { x, y });
        let rho = away.norm();
        found[n_found] = Found { robot, away, rho };
        n_found += usize::from(rho <= reach);
    }
    found.truncate(n_found);
}

/// Robots by cells of the plane.
#[derive(Debug, Clone, Default)]
struct Grid {
    n_columns: usize,
    n_rows: usize,
    /// The first robot of each cell, row by row, and the end.
    first: Vec<usize>,
    robots: Placed,
}

impl Grid {
    /// Sorts robots into cells no shorter than `reach`. False if there are so few cells
    /// that left and right neighbours are the same.
    fn sort(&mut self, torus: &Torus, reach: f64, positions: &[Vec2]) -> bool {
        (self.n_columns, self.n_rows) = (n_cells(torus.width, reach), n_cells(torus.height, reach));
        if self.n_columns < 3 || self.n_rows < 3 {
            return false;
        }
        let mut first = std::mem::take(&mut self.first);
        first.clear();
        first.resize(self.n_columns * self.n_rows + 1, 0);
        for &position in positions {
            first[self.cell(torus, position)] += 1;
        }
        let mut n = 0;
        for first in &mut first {
            n += *first;
            *first = n;
        }
        self.robots.resize(positions.len());
        // Backwards, so that every cell's robots come in their order.
        for (robot, &position) in positions.iter().enumerate().rev() {
            let place = &mut first[self.cell(torus, position)];
            *place -= 1;
            self.robots.set(*place, robot, position);
        }
        self.first = first;
        true
    }

    /// Keeps the robots as they are.
    fn keep(&mut self, positions: &[Vec2]) {
        self.robots.resize(positions.len());
        for (robot, &position) in positions.iter().enumerate() {
            self.robots.set(robot, robot, position);
        }
    }

    /// Where the robots in the cells around a position are.
    fn around(&self, torus: &Torus, position: Vec2) -> impl Iterator<Item = Range<usize>> {
        let (column, row) = self.column_and_row(torus, position);
        let rows = [row + self.n_rows - 1, row, row + 1];
        rows.into_iter().flat_map(move |row| {
            let row = row % self.n_rows * self.n_columns;
            // Neighbouring cells of a row are neighbours in memory, but for the seam.
            let last = self.n_columns - 1;
            let (middle, beyond) = match column {
                0 => (0..2, Some(last)),
                column if column == last => (last - 1..last + 1, Some(0)),
                column => (column - 1..column + 2, None),
            };
            let beyond = beyond.map(|column| column..column + 1);
            std::iter::once(middle)
                .chain(beyond)
                .map(move |columns| self.first[row + columns.start]..self.first[row + columns.end])
        })
    }

    fn cell(&self, torus: &Torus, position: Vec2) -> usize {
        let (column, row) = self.column_and_row(torus, position);
        row * self.n_columns + column
    }

    fn column_and_row(&self, torus: &Torus, position: Vec2) -> (usize, usize) {
        let column = (position.x / torus.width * self.n_columns as f64) as usize;
        let row = (position.y / torus.height * self.n_rows as f64) as usize;
        (column.min(self.n_columns - 1), row.min(self.n_rows - 1))
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
        let [seen] = neighbours.of(0).collect::<Vec<_>>()[..] else { panic!("one neighbour") };
        assert_eq!((seen.robot, seen.rho), (1, 50.0));
        assert!((seen.bearing - wrap_angle(libm::atan2(-40.0, 30.0))).abs() < 1e-15);
        let [back] = neighbours.of(1).collect::<Vec<_>>()[..] else { panic!("one neighbour") };
        assert!((back.bearing - libm::atan2(40.0, -30.0)).abs() < 1e-15);
        assert!((back.reverse_bearing() - seen.bearing).abs() < 1e-15);
        assert_eq!(neighbours.of(2).count(), 0);
    }

    #[test]
    fn robots_at_one_point_see_each_other_at_0() {
        let neighbours = neighbours(&[Vec2::new(1.0, 1.0); 2], 50.0);
        let at = |robot| Neighbour { robot, rho: 0.0, bearing: 0.0 };
        assert!(neighbours.of(0).eq([at(1)]) && neighbours.of(1).eq([at(0)]));
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
                let found: Vec<usize> = neighbours.of(robot).map(|n| n.robot).collect();
                let others = (0..positions.len()).filter(|&other| {
                    other != robot && TORUS.distance(position, positions[other]) <= reach
                });
                prop_assert_eq!(found, others.collect::<Vec<_>>());
            }
        }
    }
}

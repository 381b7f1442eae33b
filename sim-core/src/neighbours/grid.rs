//! Sorts robots by the cells of a grid.

use std::ops::Range;

use super::N_AT_ONCE;
use crate::torus::{Torus, Vec2};

/// Largest swarm that is not sorted. In a larger one, most robots are far apart, and to compare all
/// of them takes longer than to sort them.
const MAX_WITHOUT_GRID: usize = 32;
/// Most cells per robot. The number is limited because every sort visits all cells, occupied or
/// not.
const MAX_CELLS_PER_ROBOT: usize = 16;
/// Most cells per axis, to limit memory.
const MAX_CELLS: usize = 512;

/// Robots and their positions.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub robots: Vec<u32>,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
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
#[derive(Debug, Default)]
pub(super) struct Grid {
    n_columns: usize,
    n_rows: usize,
    columns_per_cm: f64,
    rows_per_cm: f64,
    /// The first robot of each cell, row by row, and the end.
    first: Vec<u32>,
    pub robots: Placed,
    /// Whether the robots are sorted by cells.
    is_sorted: bool,
    /// Scratch: the cell of each robot.
    cells: Vec<u32>,
}

impl Grid {
    /// Sorts robots into cells no shorter than `reach`, unless they are few, or there are so few
    /// cells that left and right neighbours coincide.
    pub fn sort(&mut self, torus: &Torus, reach: f64, positions: &[Vec2]) {
        let n = |extent| n_cells(extent, reach, positions.len());
        (self.n_columns, self.n_rows) = (n(torus.width), n(torus.height));
        self.is_sorted =
            positions.len() > MAX_WITHOUT_GRID && self.n_columns >= 3 && self.n_rows >= 3;
        if self.is_sorted {
            self.sort_by_cells(torus, positions);
        } else {
            self.keep(positions);
        }
    }

    fn sort_by_cells(&mut self, torus: &Torus, positions: &[Vec2]) {
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
    }

    /// Keeps the robots as they are.
    fn keep(&mut self, positions: &[Vec2]) {
        self.robots.resize(positions.len());
        for (robot, &position) in positions.iter().enumerate() {
            self.robots.set(robot, robot, position);
        }
    }

    /// Ranges of the robots in the cells around a position; all robots if they are not sorted.
    #[inline(always)]
    pub fn around(&self, position: Vec2) -> [Range<usize>; 6] {
        if !self.is_sorted {
            let all = 0..self.robots.robots.len();
            return [all, 0..0, 0..0, 0..0, 0..0, 0..0];
        }
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

//! Robots that may be near each other for some steps.

use std::ops::Range;

use determinism::Isa;
use determinism::simd::{Simd, WithSimd};

use super::grid::Grid;
use super::{N_AT_ONCE, keep_near};
use crate::torus::{Torus, Vec2};

/// How far beyond the reach candidates are, in parts of the reach. A larger margin makes lists
/// longer, and they are good for more steps.
const MARGIN: f64 = 0.25;
/// More than the rounding of a few distances, in parts of the longest.
const ROUNDING: f64 = 1e-14;

/// All robots that are near each robot, with a margin: while no robot is far from its position at
/// the time of the search, neighbours are among the candidates (L. Verlet, Phys. Rev. 159, 98,
/// 1967).
#[derive(Debug)]
pub(super) struct Candidates {
    /// Distance within which robots are neighbours, cm.
    reach: f64,
    /// The positions for which the candidates were found.
    positions: Vec<Vec2>,
    /// Index of each robot's first candidate, and the end.
    first: Vec<usize>,
    /// The candidates' numbers, with room to read the last ones in whole vectors.
    robots: Vec<u32>,
    grid: Grid,
}

impl Candidates {
    /// No candidates yet, for neighbours within `reach` cm.
    pub fn new(reach: f64) -> Self {
        Self {
            reach,
            positions: Vec::new(),
            first: Vec::new(),
            robots: Vec::new(),
            grid: Grid::default(),
        }
    }

    /// Finds candidates anew, unless those found last are good for these positions.
    pub fn update(&mut self, torus: &Torus, positions: &[Vec2]) {
        let margin = MARGIN * self.reach;
        let longest = torus.width + torus.height + self.reach;
        // Two robots may come nearer by two ways.
        let max_way = 0.5 * (margin - ROUNDING * longest);
        let ways = Ways { torus, from: &self.positions, to: positions, max_way };
        if self.positions.len() == positions.len() && Isa::best().run(ways) {
            return;
        }
        self.positions.clear();
        self.positions.extend_from_slice(positions);
        let reach = self.reach + margin;
        self.grid.sort(torus, reach, positions);
        Isa::best().run(Search { torus, reach, candidates: self });
    }

    /// The range of a robot's candidates.
    #[inline(always)]
    pub fn places(&self, robot: usize) -> Range<usize> {
        self.first[robot]..self.first[robot + 1]
    }

    /// The candidates from an index on.
    #[inline(always)]
    pub fn at(&self, place: usize) -> &[u32; N_AT_ONCE] {
        self.robots[place..].first_chunk().expect("room for a whole vector")
    }
}

/// Whether no way between positions is longer than `max_way`, cm; no way at all is short enough if
/// that is negative.
struct Ways<'a> {
    torus: &'a Torus,
    from: &'a [Vec2],
    to: &'a [Vec2],
    max_way: f64,
}

impl WithSimd for Ways<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> bool {
        let Self { torus, from, to, max_way } = self;
        let max_way_squared = max_way * max_way;
        let mut are_short = max_way >= 0.0;
        for (from, to) in from.iter().zip(to) {
            let way = torus.displacement(*from, *to);
            are_short &= way.dot(way) <= max_way_squared;
        }
        are_short
    }
}

/// The search for candidates of all robots.
struct Search<'a> {
    torus: &'a Torus,
    /// Distance within which robots are candidates, cm.
    reach: f64,
    candidates: &'a mut Candidates,
}

impl WithSimd for Search<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { torus, reach, candidates } = self;
        let Candidates { positions, first, robots, grid, .. } = candidates;
        let sorted = &grid.robots;
        first.clear();
        let mut n_found = 0;
        for (robot, &from) in positions.iter().enumerate() {
            first.push(n_found);
            for range in grid.around(from) {
                let n_then = n_found + range.len() + N_AT_ONCE;
                if robots.len() < n_then {
                    robots.resize(n_then, 0);
                }
                for start in range.clone().step_by(N_AT_ONCE) {
                    let end = range.end.min(start + N_AT_ONCE);
                    let places = start..start + N_AT_ONCE;
                    let (xs, ys) = (&sorted.x[places.clone()], &sorted.y[places]);
                    let others = &sorted.robots[start..end];
                    n_found = keep_near(
                        torus,
                        reach * reach,
                        (robot as u32, from),
                        (others, |i| Vec2 { x: xs[i], y: ys[i] }),
                        n_found,
                        |place, other, _| robots[place] = other,
                    );
                }
            }
        }
        first.push(n_found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TORUS: Torus = Torus::new(1000.0, 600.0);

    /// Candidates of two robots that are neighbours within 100 cm.
    fn found(other: Vec2) -> Candidates {
        let mut candidates = Candidates::new(100.0);
        candidates.update(&TORUS, &[Vec2::new(500.0, 300.0), other]);
        candidates
    }

    #[test]
    fn candidates_are_within_the_reach_and_its_margin() {
        assert_eq!(found(Vec2::new(625.0, 300.0)).places(0).len(), 1);
        assert_eq!(found(Vec2::new(625.1, 300.0)).places(0).len(), 0);
    }

    #[test]
    fn lists_are_good_until_a_robot_has_gone_half_the_margin() {
        let start = Vec2::new(700.0, 300.0);
        let mut candidates = found(start);
        for (x, is_good) in [(712.4, true), (687.6, true), (712.6, false), (701.0, true)] {
            let other = Vec2::new(x, 300.0);
            candidates.update(&TORUS, &[Vec2::new(500.0, 300.0), other]);
            assert_eq!(candidates.positions[1] != other, is_good, "{x}");
        }
    }

    #[test]
    fn no_lists_are_kept_where_rounding_exceeds_the_margin() {
        let world = Torus::new(1e9, 1e9);
        let mut candidates = Candidates::new(1e-9);
        for x in [1.0, 1.0 + f64::EPSILON] {
            let position = Vec2::new(x, 0.0);
            candidates.update(&world, &[position]);
            assert_eq!(candidates.positions, [position]);
        }
    }
}

//! Finds robots that are near each other, with distances and directions. They depend only on
//! positions, so they are recomputed only after a robot has moved.

mod candidates;
mod grid;

use std::f64::consts::PI;
use std::ops::Range;

use determinism::simd::{Simd, WithSimd};

use self::candidates::Candidates;
use crate::polar;
use crate::torus::{Torus, Vec2, wrap_angle};
use determinism::Isa;

/// Number of robots to process together, few enough for their scratch data to stay in the cache.
const N_ROBOTS_AT_ONCE: usize = 128;
/// Number of robots to compare at once: the longest vector holds this many numbers.
const N_AT_ONCE: usize = 8;

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
#[derive(Debug)]
pub(crate) struct Neighbours {
    /// Distance within which robots are neighbours, cm.
    reach: f64,
    /// The largest squared distance of neighbours.
    reach_squared: f64,
    candidates: Candidates,
    found: Found,
}

/// The lists of neighbours. They may have spare room.
#[derive(Debug, Default)]
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
    /// The state before the first [`update`](Self::update), in which no robot has a neighbour. The
    /// number of robots never changes.
    pub fn new(reach: f64, n_robots: usize) -> Self {
        let first = vec![0; n_robots + 1];
        let found = Found { first, ..Found::default() };
        let candidates = Candidates::new(reach);
        Self { reach, reach_squared: largest_square(reach), candidates, found }
    }

    /// Takes over the neighbours of another one, to [`retain`](Self::retain) some of them.
    pub fn copy(&mut self, other: &Self) {
        let Found { first, robots, rho, bearing, .. } = &mut self.found;
        first.clone_from(&other.found.first);
        robots.clone_from(&other.found.robots);
        rho.clone_from(&other.found.rho);
        bearing.clone_from(&other.found.bearing);
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
        self.candidates.update(torus, positions);
        let Self { reach_squared, candidates, found, .. } = self;
        let (reach_squared, candidates) = (*reach_squared, &*candidates);
        for start in (0..positions.len()).step_by(N_ROBOTS_AT_ONCE) {
            let robots = start..positions.len().min(start + N_ROBOTS_AT_ONCE);
            let range = robots.clone();
            Isa::best().run(Find { torus, reach_squared, positions, robots, candidates, found });
            found.locate(range);
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

/// The search for the neighbours of some robots.
struct Find<'a> {
    torus: &'a Torus,
    reach_squared: f64,
    positions: &'a [Vec2],
    /// The robots whose neighbours to find.
    robots: Range<usize>,
    candidates: &'a Candidates,
    found: &'a mut Found,
}

impl WithSimd for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let Self { torus, reach_squared, positions, robots, candidates, found } = self;
        let first = found.first[robots.start];
        let n_candidates =
            candidates.places(robots.end - 1).end - candidates.places(robots.start).start;
        found.make_room(first + n_candidates + N_AT_ONCE, n_candidates + N_AT_ONCE);
        let mut n_found = 0;
        for robot in robots {
            let from = positions[robot];
            let places = candidates.places(robot);
            for start in places.clone().step_by(N_AT_ONCE) {
                let others = candidates.at(start);
                let at = others.map(|other| positions[other as usize]);
                n_found = keep_near(
                    torus,
                    reach_squared,
                    (robot as u32, from),
                    (&others[..N_AT_ONCE.min(places.end - start)], |i| at[i]),
                    n_found,
                    |place, other, away| {
                        found.robots[first + place] = other;
                        (found.away_x[place], found.away_y[place]) = (away.x, away.y);
                    },
                );
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

/// Writes those of up to eight other robots that are near a robot, from place `n_found` on, and
/// returns the place after the last. `write` gets a place, a robot and the way to it.
///
/// The outcome is unpredictable, so the code has no branch: it writes every robot, and then
/// overwrites a robot that is not near with the next robot.
#[inline(always)]
fn keep_near(
    torus: &Torus,
    reach_squared: f64,
    (robot, from): (u32, Vec2),
    (others, position): (&[u32], impl Fn(usize) -> Vec2),
    mut n_found: usize,
    mut write: impl FnMut(usize, u32, Vec2),
) -> usize {
    let (mut away_x, mut away_y) = ([0.0; N_AT_ONCE], [0.0; N_AT_ONCE]);
    let mut squares = [0.0; N_AT_ONCE];
    for i in 0..N_AT_ONCE {
        let away = torus.displacement(from, position(i));
        (away_x[i], away_y[i]) = (away.x, away.y);
        squares[i] = away.x * away.x + away.y * away.y;
    }
    for (i, &other) in others.iter().enumerate() {
        write(n_found, other, Vec2 { x: away_x[i], y: away_y[i] });
        n_found += usize::from((squares[i] <= reach_squared) & (other != robot));
    }
    n_found
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use determinism::random::{Purpose, Stream};
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

    /// Asserts that every robot has the right neighbours.
    fn check(torus: &Torus, neighbours: &Neighbours, positions: &[Vec2], reach: f64) {
        for (robot, &position) in positions.iter().enumerate() {
            let mut found: Vec<usize> = neighbours.of_robot(robot).map(|n| n.robot).collect();
            found.sort_unstable();
            let others = (0..positions.len()).filter(|&other| {
                other != robot && torus.distance(position, positions[other]) <= reach
            });
            assert_eq!(found, others.collect::<Vec<_>>(), "of robot {robot}");
        }
    }

    proptest! {
        #[test]
        fn everybody_within_reach_is_found_once(
            points in prop::collection::vec((0.0..1000.0, 0.0..600.0), 0..200),
            reach in prop::sample::select(vec![1.0, 40.0, 199.9, 200.0, 250.0, 2000.0]),
        ) {
            let positions: Vec<Vec2> = points.into_iter().map(|(x, y)| Vec2::new(x, y)).collect();
            check(&TORUS, &neighbours(&positions, reach), &positions, reach);
        }

        /// Robots go `speed` cm per step, some of them in other directions after each step, and
        /// now and then one is put elsewhere.
        #[test]
        fn everybody_within_reach_is_found_while_robots_move(
            seed in 0_u64..1 << 32,
            n_robots in 2_usize..80,
            reach in prop::sample::select(vec![1e-7, 1.0, 40.0, 120.0, 2000.0]),
            speed in prop::sample::select(vec![0.0, 0.01, 0.05, 0.12, 0.124, 0.13, 0.5]),
            torus in prop::sample::select(vec![TORUS, Torus::walled(1000.0, 600.0)]),
        ) {
            let mut draws = Stream::new(seed, 0_u64, 0, Purpose::Positions, 0);
            // Most robots are near each other.
            let extent = f64::min(4.0 * reach, 600.0);
            let mut positions: Vec<Vec2> = (0..n_robots)
                .map(|_| Vec2::new(draws.uniform() * extent, draws.uniform() * extent))
                .collect();
            let mut headings = vec![0.0; n_robots];
            let mut neighbours = Neighbours::new(reach, n_robots);
            for _ in 0..20 {
                neighbours.update(&torus, &positions);
                check(&torus, &neighbours, &positions, reach);
                for (position, heading) in positions.iter_mut().zip(&mut headings) {
                    if draws.bernoulli(0.2) {
                        *heading = draws.uniform() * TAU;
                    }
                    *position = torus.wrap(*position + Vec2::unit(*heading) * (speed * reach));
                }
                if draws.bernoulli(0.05) {
                    positions[0] = Vec2::new(draws.uniform() * extent, draws.uniform() * extent);
                }
            }
        }
    }
}

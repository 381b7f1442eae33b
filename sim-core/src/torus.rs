//! Positions, displacements and angles on the flat torus.

use std::f64::consts::TAU;
use std::ops::{Add, Mul, Neg, Sub};

use serde::Serialize;

use crate::polar;

/// A position, or a displacement, in the plane; cm.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Vec2 {
    /// Along the world's width.
    pub x: f64,
    /// Along the world's height.
    pub y: f64,
}

impl Vec2 {
    /// The vector (x, y).
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// (cos, sin) of an angle.
    pub(crate) fn unit(angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self { x: cos, y: sin }
    }

    /// Euclidean norm.
    #[inline(always)]
    pub(crate) fn norm(self) -> f64 {
        (self.x * self.x + self.y * self.y).sqrt()
    }

    /// Signed angle in \[0, 2 pi); 0 for the zero vector.
    pub(crate) fn angle(self) -> f64 {
        polar::angle(self.x, self.y)
    }

    /// Scalar product.
    pub(crate) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// The third component of the vector product.
    pub(crate) fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// Turned by the angle whose (cos, sin) is `axis`.
    pub(crate) fn rotated(self, axis: Self) -> Self {
        Self { x: axis.x * self.x - axis.y * self.y, y: axis.y * self.x + axis.x * self.y }
    }

    /// Turned back by that angle.
    pub(crate) fn unrotated(self, axis: Self) -> Self {
        self.rotated(Self { x: axis.x, y: -axis.y })
    }

    /// Turned by a quarter, counter-clockwise.
    pub(crate) fn turned_left(self) -> Self {
        Self { x: -self.y, y: self.x }
    }

    /// Turned by a quarter, clockwise.
    pub(crate) fn turned_right(self) -> Self {
        Self { x: self.y, y: -self.x }
    }

    /// The unit vector in this direction; zero of the zero vector.
    pub(crate) fn unit_or_zero(self) -> Self {
        let norm = self.norm();
        if norm > 0.0 { self * (1.0 / norm) } else { Self::default() }
    }
}

impl Add for Vec2 {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y }
    }
}

impl Sub for Vec2 {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }
}

impl Neg for Vec2 {
    type Output = Self;

    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y }
    }
}

impl Mul<f64> for Vec2 {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { x: self.x * factor, y: self.y * factor }
    }
}

/// The same angle in \[0, 2 pi).
pub(crate) fn wrap_angle(angle: f64) -> f64 {
    wrap(angle, TAU)
}

/// Absolute difference, in \[0, pi\], of two angles in \[0, 2 pi).
pub(crate) fn angular_difference(a: f64, b: f64) -> f64 {
    let difference = (a - b).abs();
    difference.min(TAU - difference)
}

/// Direction of sector `sector` of `n_sectors` in the robot's own frame, in
/// \[0, 2 pi).
pub(crate) fn sector_angle(sector: usize, n_sectors: usize) -> f64 {
    sector as f64 * TAU / n_sectors as f64
}

/// x modulo `period`, in \[0, period).
fn wrap(x: f64, period: f64) -> f64 {
    if (0.0..period).contains(&x) {
        return x;
    }
    // A faster way for sums and differences of two angles, with the same bits.
    let rest = if (-period..0.0).contains(&x) {
        x + period
    } else if (period..2.0 * period).contains(&x) {
        x - period
    } else {
        x.rem_euclid(period)
    };
    // A tiny negative x rounds up to the period itself.
    if rest < period { rest } else { 0.0 }
}

/// The world's plane: a flat torus, where objects that leave on one side enter on the opposite
/// side, or a plane without that seam, for a world between walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Torus {
    /// Extent of the world along x, cm.
    pub width: f64,
    /// Extent of the world along y, cm.
    pub height: f64,
    /// Periods along x and y, cm; infinite without a seam.
    period: Vec2,
}

impl Torus {
    /// A torus of this extent.
    pub const fn new(width: f64, height: f64) -> Self {
        Self { width, height, period: Vec2::new(width, height) }
    }

    /// A plane without a seam, of which the world has this extent.
    pub const fn walled(width: f64, height: f64) -> Self {
        Self { width, height, period: Vec2::new(f64::INFINITY, f64::INFINITY) }
    }

    /// The middle of the world (W/2, H/2).
    pub fn center(&self) -> Vec2 {
        Vec2 { x: 0.5 * self.width, y: 0.5 * self.height }
    }

    /// The same position with coordinates from 0 to below the period.
    pub fn wrap(&self, position: Vec2) -> Vec2 {
        if self.period.x == f64::INFINITY {
            return position;
        }
        Vec2 { x: wrap(position.x, self.period.x), y: wrap(position.y, self.period.y) }
    }

    /// The shortest displacement from `from` to `to`; both within the torus.
    #[inline(always)]
    pub fn displacement(&self, from: Vec2, to: Vec2) -> Vec2 {
        let Vec2 { x, y } = self.period;
        Vec2 { x: shortest(to.x - from.x, x), y: shortest(to.y - from.y, y) }
    }

    /// Length of the shortest displacement between two positions, cm.
    pub fn distance(&self, a: Vec2, b: Vec2) -> f64 {
        self.displacement(a, b).norm()
    }

    /// Centre of mass of positions: the mean of the shortest displacements from the first position.
    /// It equals the centre in the plane if the positions extend over less than half the world.
    /// Returns the origin without positions.
    pub fn centroid(&self, positions: &[Vec2]) -> Vec2 {
        let Some(&first) = positions.first() else { return Vec2::default() };
        let sum = positions.iter().fold(Vec2::default(), |sum, &position| {
            let way = self.displacement(first, position);
            Vec2 { x: sum.x + way.x, y: sum.y + way.y }
        });
        let n = positions.len() as f64;
        self.wrap(Vec2 { x: first.x + sum.x / n, y: first.y + sum.y / n })
    }
}

/// The equivalent of `difference` with the least absolute value. `difference`: in (-period,
/// period).
#[inline(always)]
fn shortest(difference: f64, period: f64) -> f64 {
    let half = 0.5 * period;
    // The code has no branch, because positions are unpredictable.
    let above = if difference > half { period } else { 0.0 };
    let below = if difference < -half { period } else { 0.0 };
    difference - above + below
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;

    const TORUS: Torus = Torus::new(1000.0, 600.0);

    fn point() -> impl Strategy<Value = Vec2> {
        (-1e4..1e4, -1e4..1e4).prop_map(|(x, y)| TORUS.wrap(Vec2::new(x, y)))
    }

    proptest! {
        #[test]
        fn wrapped_positions_lie_in_the_torus(x in -1e6..1e6, y in -1e6..1e6) {
            let p = TORUS.wrap(Vec2::new(x, y));
            prop_assert!((0.0..1000.0).contains(&p.x) && (0.0..600.0).contains(&p.y));
            prop_assert_eq!(TORUS.wrap(p), p);
        }

        #[test]
        fn displacements_are_shortest_antisymmetric_and_lead_to_the_target(a in point(), b in point()) {
            let d = TORUS.displacement(a, b);
            prop_assert!(d.x.abs() <= 500.0 && d.y.abs() <= 300.0);
            let back = TORUS.displacement(b, a);
            prop_assert_eq!((d.x, d.y), (-back.x, -back.y));
            let reached = TORUS.wrap(Vec2::new(a.x + d.x, a.y + d.y));
            prop_assert!(TORUS.distance(reached, b) < 1e-9);
        }

        #[test]
        fn distance_is_a_metric_that_translations_keep(a in point(), b in point(), c in point()) {
            let ab = TORUS.distance(a, b);
            prop_assert!(ab <= TORUS.distance(a, c) + TORUS.distance(c, b) + 1e-9);
            let shift = |p: Vec2| TORUS.wrap(Vec2::new(p.x + c.x, p.y + c.y));
            prop_assert!((TORUS.distance(shift(a), shift(b)) - ab).abs() < 1e-9);
        }

        #[test]
        fn angles_wrap_and_differ_symmetrically(a in -50.0..50.0f64, b in -50.0..50.0f64) {
            let (a, b) = (wrap_angle(a), wrap_angle(b));
            prop_assert!((0.0..TAU).contains(&a));
            let d = angular_difference(a, b);
            prop_assert!((0.0..=PI).contains(&d));
            prop_assert_eq!(d, angular_difference(b, a));
        }
    }

    #[test]
    fn the_shortest_way_crosses_the_seam() {
        let d = TORUS.displacement(Vec2::new(990.0, 5.0), Vec2::new(10.0, 595.0));
        assert_eq!((d.x, d.y), (20.0, -10.0));
    }

    #[test]
    fn the_centroid_of_a_swarm_on_the_seam_is_on_the_seam() {
        let swarm = [Vec2::new(990.0, 0.0), Vec2::new(20.0, 590.0), Vec2::new(20.0, 580.0)];
        let centroid = TORUS.centroid(&swarm);
        assert!(TORUS.distance(centroid, Vec2::new(10.0, 590.0)) < 1e-9, "{centroid:?}");
    }

    #[test]
    fn bearings_are_signed() {
        assert_eq!(Vec2::new(1.0, 0.0).angle(), 0.0);
        assert_eq!(Vec2::new(0.0, 1.0).angle(), FRAC_PI_2);
        assert_eq!(Vec2::new(-1.0, 0.0).angle(), PI);
        assert_eq!(Vec2::new(0.0, -1.0).angle(), 3.0 * FRAC_PI_2);
        assert_eq!(Vec2::new(-0.0, -0.0).angle(), 0.0);
    }

    #[test]
    fn tiny_negative_values_do_not_become_the_period() {
        assert_eq!(wrap_angle(-1e-20), 0.0);
        assert_eq!(TORUS.wrap(Vec2::new(-1e-20, -1e-20)), Vec2::new(0.0, 0.0));
    }

    #[test]
    fn sectors_divide_the_circle() {
        assert_eq!(sector_angle(0, 4), 0.0);
        assert_eq!(sector_angle(1, 4), FRAC_PI_2);
        assert_eq!(sector_angle(3, 4), 3.0 * FRAC_PI_2);
    }
}

//! Geometry of the flat torus (section 3.1) and of angles.

use std::f64::consts::{PI, TAU};

/// A point, or a displacement, in cm.
pub type Vector = [f64; 2];

/// The rectangle [0, W) x [0, H) whose opposite sides are joined.
#[derive(Clone, Copy)]
pub struct Torus {
    pub width: f64,
    pub height: f64,
}

impl Torus {
    /// The same point with coordinates in [0, W) x [0, H).
    pub fn wrap(self, [x, y]: Vector) -> Vector {
        [wrap_once(x, self.width), wrap_once(y, self.height)]
    }

    /// Displacement from `a` to `b`: per axis, the representative of b - a with
    /// the least absolute value.
    pub fn displacement(self, a: Vector, b: Vector) -> Vector {
        [shortest(b[0] - a[0], self.width), shortest(b[1] - a[1], self.height)]
    }

    /// Euclidean norm of the displacement.
    pub fn distance(self, a: Vector, b: Vector) -> f64 {
        norm(self.displacement(a, b))
    }

    /// Eq. 3.2 with its sign: the angle of the displacement in [0, 2pi); 0 if
    /// the points coincide.
    pub fn bearing(self, a: Vector, b: Vector) -> f64 {
        match self.displacement(a, b) {
            [0.0, 0.0] => 0.0,
            [dx, dy] => wrap_angle(dy.atan2(dx)),
        }
    }

    pub fn centre(self) -> Vector {
        [self.width / 2.0, self.height / 2.0]
    }
}

pub fn norm([x, y]: Vector) -> f64 {
    (x * x + y * y).sqrt()
}

fn wrap_once(x: f64, period: f64) -> f64 {
    let wrapped = x.rem_euclid(period);
    // A tiny negative x rounds up to the period itself.
    if wrapped == period { 0.0 } else { wrapped }
}

fn shortest(d: f64, period: f64) -> f64 {
    let mut best = d;
    for candidate in [d - period, d + period] {
        if candidate.abs() < best.abs() {
            best = candidate;
        }
    }
    best
}

/// The angle in [0, 2pi).
pub fn wrap_angle(angle: f64) -> f64 {
    wrap_once(angle, TAU)
}

/// Eq. 3.10: absolute difference of two angles, in [0, pi].
pub fn angular_difference(a: f64, b: f64) -> f64 {
    let difference = wrap_angle(a - b);
    if difference > PI { TAU - difference } else { difference }
}

/// Eq. 3.7: absolute direction of sector j of n of a robot with this heading.
pub fn sector_direction(heading: f64, j: u32, n: u32) -> f64 {
    heading + f64::from(j) * TAU / f64::from(n)
}

#[test]
fn the_shortest_way_may_cross_the_border() {
    let torus = Torus { width: 1000.0, height: 500.0 };
    assert_eq!(torus.displacement([990.0, 10.0], [10.0, 490.0]), [20.0, -20.0]);
    assert_eq!(torus.wrap([-10.0, 510.0]), [990.0, 10.0]);
    assert_eq!(torus.wrap([-1e-20, 500.0]), [0.0, 0.0]);
    assert!((torus.bearing([990.0, 10.0], [10.0, 490.0]) - 1.75 * PI).abs() < 1e-15);
    assert_eq!(torus.bearing([3.0, 3.0], [3.0, 3.0]), 0.0);
    assert!((angular_difference(0.1, TAU - 0.1) - 0.2).abs() < 1e-15);
}

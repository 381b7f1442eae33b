//! Polar coordinates of many points at once.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use determinism::simd::{Simd, WithSimd};

use crate::torus::Vec2;
use determinism::Isa;

/// Computes the polar coordinates of points (x, y), cm: `rho`, the distance from the origin, cm,
/// and `bearing`, the direction from the origin, in \[0, 2 pi). The origin itself has bearing 0.
/// All slices have the same length.
pub(crate) fn complete(x: &[f64], y: &[f64], rho: &mut [f64], bearing: &mut [f64]) {
    Isa::best().run(Complete { x, y, rho, bearing });
}

struct Complete<'a> {
    x: &'a [f64],
    y: &'a [f64],
    rho: &'a mut [f64],
    bearing: &'a mut [f64],
}

impl WithSimd for Complete<'_> {
    type Output = ();

    /// Without branches, the compiler computes several points at once. Blocks keep the compiler
    /// from computing the last points one by one.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        const N: usize = 16;
        let Self { x, y, rho, bearing } = self;
        let polar = rho.chunks_mut(N).zip(bearing.chunks_mut(N));
        for ((x, y), (rho, bearing)) in x.chunks(N).zip(y.chunks(N)).zip(polar) {
            let (mut xs, mut ys) = ([0.0; N], [0.0; N]);
            let (mut rhos, mut bearings) = ([0.0; N], [0.0; N]);
            xs[..x.len()].copy_from_slice(x);
            ys[..y.len()].copy_from_slice(y);
            for i in 0..N {
                rhos[i] = Vec2 { x: xs[i], y: ys[i] }.norm();
                bearings[i] = angle(xs[i], ys[i]);
            }
            rho.copy_from_slice(&rhos[..rho.len()]);
            bearing.copy_from_slice(&bearings[..bearing.len()]);
        }
    }
}

/// The angle of a vector in \[0, 2 pi), to 4e-16 of a turn; 0 for the zero vector, with zeros of
/// any sign.
#[inline(always)]
pub(crate) fn angle(x: f64, y: f64) -> f64 {
    let (width, height) = (x.abs(), y.abs());
    let is_steep = height > width;
    let (short, long) = if is_steep { (width, height) } else { (height, width) };
    // atan(t) = pi/4 + atan((t - 1) / (t + 1)) keeps the argument below tan(pi/8).
    let is_large = short > TAN_PI_8 * long;
    let numerator = if is_large { short - long } else { short };
    let denominator = if is_large { short + long } else { long };
    let t = numerator / if denominator == 0.0 { 1.0 } else { denominator };
    let z = t * t;
    let mut p = ATAN[ATAN.len() - 1];
    let mut power = ATAN.len() - 1;
    while power > 0 {
        power -= 1;
        p = p * z + ATAN[power];
    }
    let atan = t + t * z * p;
    let octant = atan + if is_large { FRAC_PI_4 } else { 0.0 };
    let quadrant = if is_steep { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    let whole = if y < 0.0 { TAU - half } else { half };
    // A tiny negative angle would round up to a full turn.
    if whole < TAU { whole } else { 0.0 }
}

const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// (atan(t) / t - 1) / t^2 by powers of t^2, lowest first: minimax for the relative error of
/// atan on |t| <= tan(pi/8), which is 3.4e-17.
const ATAN: [f64; 10] = [
    -0.333_333_333_333_302_2,
    0.199_999_999_991_046_98,
    -0.142_857_141_965_300_4,
    0.111_111_067_036_958_24,
    -0.090_907_835_316_541_02,
    0.076_900_833_942_818_03,
    -0.066_412_465_650_144_66,
    0.056_931_663_427_551_68,
    -0.043_608_295_245_473_72,
    0.021_280_189_344_705_117,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// In steps of 1/1000 of a turn, and near the axes and diagonals.
    fn directions() -> impl Iterator<Item = f64> {
        let near = (0..8).flat_map(|octant| {
            [-1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-3]
                .map(|offset| f64::from(octant) * FRAC_PI_4 + offset)
        });
        (0..1000).map(|part| f64::from(part) * TAU / 1000.0).chain(near)
    }

    #[test]
    fn angles_agree_with_the_library() {
        for direction in directions() {
            for length in [1e-3, 1.0, 777.7] {
                let (x, y) = (length * libm::cos(direction), length * libm::sin(direction));
                let expected = libm::atan2(y, x).rem_euclid(TAU);
                let difference = (angle(x, y) - expected).abs();
                assert!(difference.min(TAU - difference) < 2e-15, "{direction}: {difference}");
                assert!((0.0..TAU).contains(&angle(x, y)), "{direction}");
            }
        }
    }

    #[test]
    fn axes_and_diagonals_are_exact() {
        let expected = [
            ((0.0, 0.0), 0.0),
            ((-0.0, -0.0), 0.0),
            ((1.0, 0.0), 0.0),
            ((1.0, -0.0), 0.0),
            ((1.0, 1.0), FRAC_PI_4),
            ((0.0, 1.0), FRAC_PI_2),
            ((-1.0, 1.0), 3.0 * FRAC_PI_4),
            ((-1.0, 0.0), PI),
            ((-1.0, -0.0), PI),
            ((0.0, -1.0), 3.0 * FRAC_PI_2),
            ((1.0, -1e-20), 0.0),
        ];
        for ((x, y), expected) in expected {
            assert_eq!(angle(x, y), expected, "{x}, {y}");
        }
    }

    #[test]
    fn many_points_at_once_give_the_bits_of_single_points() {
        for n in [0, 1, 15, 16, 17, 100] {
            let directions: Vec<f64> = directions().take(n).collect();
            let points = |f: fn(f64) -> f64| -> Vec<f64> {
                directions.iter().map(|&direction| 3.0 * f(direction)).collect()
            };
            let (x, y) = (points(libm::cos), points(libm::sin));
            let (mut rho, mut bearing) = (vec![0.0; n], vec![0.0; n]);
            complete(&x, &y, &mut rho, &mut bearing);
            for i in 0..n {
                assert_eq!(rho[i].to_bits(), Vec2 { x: x[i], y: y[i] }.norm().to_bits());
                assert_eq!(bearing[i].to_bits(), angle(x[i], y[i]).to_bits());
            }
        }
    }
}

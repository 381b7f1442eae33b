//! The fused multiply-add of every level against the standard library's.
#![allow(
    clippy::disallowed_methods,
    reason = "powers of two are exact, and the multiply-add is what the tests compare with"
)]

use super::*;
use crate::Isa;
use crate::random::{Purpose, Stream};

/// a * b + c of many values.
struct MulAdds<'a> {
    abc: &'a [Vec<f32>; 3],
    results: &'a mut [f32],
}

impl WithSimd for MulAdds<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let [a, b, c] = self.abc;
        let (a, b, c) = (S::as_simd_f32s(a).0, S::as_simd_f32s(b).0, S::as_simd_f32s(c).0);
        let results = S::as_mut_simd_f32s(self.results).0;
        for (((result, a), b), c) in results.iter_mut().zip(a).zip(b).zip(c) {
            *result = simd.mul_add_f32s(*a, *b, *c);
        }
    }
}

/// Compares all levels, and the scalar function, with `f32::mul_add`. Pads to whole vectors.
fn check(abc: &mut [Vec<f32>; 3]) {
    let n = abc[0].len().next_multiple_of(16);
    abc.iter_mut().for_each(|values| values.resize(n, 1.0));
    let mut results = vec![0.0; n];
    for isa in Isa::available() {
        isa.run(MulAdds { abc, results: &mut results });
        for (i, &result) in results.iter().enumerate() {
            let [a, b, c] = [abc[0][i], abc[1][i], abc[2][i]];
            let expected = a.mul_add(b, c);
            let scalar = mul_add(a, b, c);
            assert!(
                same(result, expected),
                "{isa}: {a:e} * {b:e} + {c:e} = {expected:e}, not {result:e}"
            );
            assert!(same(scalar, expected), "{a:e} * {b:e} + {c:e} = {expected:e}, not {scalar:e}");
        }
    }
}

/// The payloads of NaN differ between processors.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

fn bits(stream: &mut Stream) -> u64 {
    // A uniform number has 53 random bits.
    (stream.uniform() * (1_u64 << 53) as f64) as u64
}

/// An operand: of any bits, near another exponent, of few bits, subnormal, or at a border.
fn operand(stream: &mut Stream) -> f32 {
    let random = bits(stream);
    let (any, kind) = ((random >> 8) as u32, random % 8);
    match kind {
        0..=1 => f32::from_bits(any),
        2 => f32::from_bits((any & 0x807f_ffff) | 0x3f80_0000),
        3 => f32::from_bits((any & 0x8000_0fff) | ((100 + (any >> 12) % 56) << 23)),
        4 => f32::from_bits(any & 0xfff0_0000),
        5 => f32::from_bits(any & 0x80ff_ffff),
        6 => f32::from_bits((any & 0x80ff_ffff) | 0x7f00_0000),
        _ => BORDERS[any as usize % BORDERS.len()],
    }
}

#[rustfmt::skip]
const BORDERS: [f32; 24] = [
    0.0, -0.0, 1.0, -1.0, 0.5, 1.5, 3.0, f32::EPSILON, 1.0 + f32::EPSILON, 1.0 - f32::EPSILON / 2.0,
    f32::MIN_POSITIVE, -f32::MIN_POSITIVE, f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY,
    f32::NAN, 1e-45, -1e-45, 1.175_494_2e-38, 16_777_216.0, 16_777_215.0, 8_388_609.0, 5.9e-39,
];

/// The third operand: any one, the product cancelled, or so small or large beside the product that
/// their sum is nearly midway between two f32.
fn addend(stream: &mut Stream, a: f32, b: f32) -> f32 {
    let random = bits(stream);
    let product = f64::from(a) * f64::from(b);
    let rounded = product as f32;
    let step = (random >> 8) % 5;
    match random % 6 {
        0 => operand(stream),
        1 => -f32::from_bits(rounded.to_bits().wrapping_add(step as u32).wrapping_sub(2)),
        2 => -(product - f64::from(rounded)) as f32,
        // A power of two at or below half a unit of the product's last place.
        3 => (product * 2_f64.powi(-24 - (step as i32))) as f32,
        // The product is at or below half a unit of the sum's last place.
        4 => (product * 2_f64.powi(23 + (step as i32))) as f32,
        _ => f32::from_bits((product.abs() * 2_f64.powi(random as i32 % 60)) as f32 as u32),
    }
}

#[test]
fn multiply_adds_of_all_borders_round_once() {
    let mut abc = [const { Vec::new() }; 3];
    for a in BORDERS {
        for b in BORDERS {
            for c in BORDERS {
                for (values, value) in abc.iter_mut().zip([a, b, c]) {
                    values.push(value);
                }
            }
        }
    }
    check(&mut abc);
}

/// Sums whose rounding to 53 bits ends midway between two f32, normal and subnormal, although the
/// exact sum is above or below: the product is a power of two, but for the last of its bits.
#[test]
fn sums_that_two_roundings_would_spoil_are_rounded_once() {
    // 2^46 + 1, and 2^46 - 1 = (2^23 + 1)(2^23 - 1).
    let above = (8_384_513.0, 8_392_705.0);
    let below = (8_388_609.0, 8_388_607.0);
    let mut abc = [const { Vec::new() }; 3];
    let (mut n_normal, mut n_subnormal) = (0, 0);
    for exponent in -149..=104 {
        for significand in
            (0..24).flat_map(|power| [1_u32 << power, (1 << power) + 1, (2 << power) - 1])
        {
            let c = (f64::from(significand) * 2_f64.powi(exponent)) as f32;
            // Half a unit in the last place, also of the sums that use all 24 bits.
            for lower in [0, 1 + significand.ilog2() as i32 - 24] {
                let half = exponent + lower - 1;
                for ((a, b), sign) in [(above, 1.0), (below, 1.0), (above, -1.0), (below, -1.0)] {
                    let a = (a * 2_f64.powi(half.div_euclid(2) - 23)) as f32;
                    let b = (sign * b * 2_f64.powi(half - half.div_euclid(2) - 23)) as f32;
                    let twice = (f64::from(a) * f64::from(b) + f64::from(c)) as f32;
                    let once = a.mul_add(b, c);
                    let is_spoilt = !same(twice, once);
                    n_subnormal += u32::from(is_spoilt && once.abs() < f32::MIN_POSITIVE);
                    n_normal += u32::from(is_spoilt && once.abs() >= f32::MIN_POSITIVE);
                    for (values, value) in abc.iter_mut().zip([a, b, c]) {
                        values.push(value);
                    }
                }
            }
        }
    }
    assert!(n_normal > 1_000 && n_subnormal > 10, "{n_normal} and {n_subnormal} hard cases");
    check(&mut abc);
}

/// `SWARM_MULTIPLY_ADDS` sets the number of cases.
#[test]
fn random_multiply_adds_round_once() {
    let n: u64 = std::env::var("SWARM_MULTIPLY_ADDS")
        .map_or(1_000_000, |n| n.parse().expect("SWARM_MULTIPLY_ADDS is a number"));
    const AT_ONCE: u64 = 1 << 14;
    for block in 0..n.div_ceil(AT_ONCE) {
        let mut stream = Stream::new(1, 0_u64, block, Purpose::Script, 0);
        let mut abc = [const { Vec::new() }; 3];
        for _ in 0..AT_ONCE.min(n - block * AT_ONCE) {
            let (a, b) = (operand(&mut stream), operand(&mut stream));
            let c = addend(&mut stream, a, b);
            for (values, value) in abc.iter_mut().zip([a, b, c]) {
                values.push(value);
            }
        }
        check(&mut abc);
    }
}

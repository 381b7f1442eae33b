//! Vectors of four f32 with the instructions that every browser has.

use std::arch::wasm32::v128;

use pulp::core_arch::wasm::Simd128;

pub(super) type F32x4 = v128;
pub(super) type U32x4 = v128;
pub(super) type Mask = v128;

/// Modules of this target have them, so that this is no question at run time.
#[inline(always)]
fn simd128() -> Simd128 {
    Simd128::try_new().expect("the target has SIMD128")
}

macro_rules! instructions {
    ($($name:ident($($argument:ident: $type:ty),*) -> $result:ty { $value:expr })*) => {
        $(
            #[inline(always)]
            pub(super) fn $name($($argument: $type),*) -> $result {
                $value
            }
        )*
    };
}

instructions! {
    splat(value: f32) -> F32x4 { simd128().f32x4_splat(value) }
    splat_bits(value: u32) -> U32x4 { simd128().u32x4_splat(value) }
    add(a: F32x4, b: F32x4) -> F32x4 { simd128().f32x4_add(a, b) }
    sub(a: F32x4, b: F32x4) -> F32x4 { simd128().f32x4_sub(a, b) }
    mul(a: F32x4, b: F32x4) -> F32x4 { simd128().f32x4_mul(a, b) }
    div(a: F32x4, b: F32x4) -> F32x4 { simd128().f32x4_div(a, b) }
    negate(a: F32x4) -> F32x4 { simd128().f32x4_neg(a) }
    sqrt(a: F32x4) -> F32x4 { simd128().f32x4_sqrt(a) }
    equal(a: F32x4, b: F32x4) -> Mask { simd128().f32x4_eq(a, b) }
    less(a: F32x4, b: F32x4) -> Mask { simd128().f32x4_lt(a, b) }
    less_or_equal(a: F32x4, b: F32x4) -> Mask { simd128().f32x4_le(a, b) }
    and(a: Mask, b: Mask) -> Mask { simd128().v128_and(a, b) }
    select(mask: Mask, yes: F32x4, no: F32x4) -> F32x4 { simd128().v128_bitselect(yes, no, mask) }
    // A bit for each lane, the lowest for the first.
    lanes(mask: Mask) -> u32 { u32::from(simd128().i32x4_bitmask(mask)) }
}

/// a * b + c, rounded once. The sum in f64 decides nearly always; see [`is_doubtful`].
#[inline(always)]
pub(super) fn mul_add(a: F32x4, b: F32x4, c: F32x4) -> F32x4 {
    let low = sum(
        simd128().f64x2_promote_low_f32x4(a),
        simd128().f64x2_promote_low_f32x4(b),
        simd128().f64x2_promote_low_f32x4(c),
    );
    let high = sum(upper(a), upper(b), upper(c));
    let rounded = simd128().i64x2_shuffle::<0, 2>(
        simd128().f32x4_demote_f64x2_zero(low),
        simd128().f32x4_demote_f64x2_zero(high),
    );
    if is_doubtful(low, high, c) { exact(a, b, c) } else { rounded }
}

/// Whether a second rounding may go wrong: a sum is midway between two f32, or may be inexact and
/// subnormal. It is exact if c is 0, or if c is 2^-102 or more: product and sum are then multiples
/// of 2^-150.
#[inline(always)]
fn is_doubtful(low: v128, high: v128, c: F32x4) -> bool {
    // The 29 bits that the second rounding drops.
    let ends = simd128().i32x4_shuffle::<0, 2, 4, 6>(low, high);
    let dropped = simd128().v128_and(ends, simd128().u32x4_splat(0x1fff_ffff));
    let is_midway = simd128().i32x4_eq(dropped, simd128().u32x4_splat(0x1000_0000));
    // Twice the bits drop the sign. Subtracting 1 excludes zero.
    let magnitude = simd128().i32x4_add(c, c);
    let shifted = simd128().i32x4_sub(magnitude, simd128().u32x4_splat(1));
    let is_tiny = simd128().u32x4_lt(shifted, simd128().u32x4_splat(2 * TINY.to_bits() - 1));
    simd128().v128_any_true(simd128().v128_or(is_midway, is_tiny))
}

/// 2^-102
const TINY: f32 = f32::from_bits((127 - 102) << 23);

/// [`mul_add`] for doubtful sums.
#[cold]
#[inline(never)]
fn exact(a: F32x4, b: F32x4, c: F32x4) -> F32x4 {
    use pulp::bytemuck::cast;
    let [a, b, c] = [a, b, c].map(cast::<_, [f32; 4]>);
    cast([0, 1, 2, 3].map(|i| super::super::fused::mul_add(a[i], b[i], c[i])))
}

/// a * b + c of the f64, in two roundings of which the first is exact.
#[inline(always)]
fn sum(a: v128, b: v128, c: v128) -> v128 {
    simd128().f64x2_add(simd128().f64x2_mul(a, b), c)
}

/// The upper half as f64.
#[inline(always)]
fn upper(a: F32x4) -> v128 {
    simd128().f64x2_promote_low_f32x4(simd128().i64x2_shuffle::<1, 1>(a, a))
}

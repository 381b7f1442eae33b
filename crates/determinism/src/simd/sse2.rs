//! Vectors of four f32 with the instructions that every x86-64 processor has.

#[cfg(target_arch = "x86")]
use std::arch::x86::{__m128, __m128d, __m128i};
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m128, __m128d, __m128i};

use pulp::bytemuck::cast;
use pulp::core_arch::x86::{Sse, Sse2};

pub(super) type F32x4 = __m128;
pub(super) type U32x4 = __m128i;
pub(super) type Mask = __m128;

/// Every processor of this target has them, so that this is no question at run time.
#[inline(always)]
fn sse() -> Sse {
    Sse::try_new().expect("the target has SSE")
}

/// As [`sse`].
#[inline(always)]
fn sse2() -> Sse2 {
    Sse2::try_new().expect("the target has SSE2")
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
    splat(value: f32) -> F32x4 { sse()._mm_set1_ps(value) }
    splat_bits(value: u32) -> U32x4 { sse2()._mm_set1_epi32(value.cast_signed()) }
    add(a: F32x4, b: F32x4) -> F32x4 { sse()._mm_add_ps(a, b) }
    sub(a: F32x4, b: F32x4) -> F32x4 { sse()._mm_sub_ps(a, b) }
    mul(a: F32x4, b: F32x4) -> F32x4 { sse()._mm_mul_ps(a, b) }
    div(a: F32x4, b: F32x4) -> F32x4 { sse()._mm_div_ps(a, b) }
    negate(a: F32x4) -> F32x4 { sse()._mm_xor_ps(a, sse()._mm_set1_ps(-0.0)) }
    sqrt(a: F32x4) -> F32x4 { sse()._mm_sqrt_ps(a) }
    equal(a: F32x4, b: F32x4) -> Mask { sse()._mm_cmpeq_ps(a, b) }
    less(a: F32x4, b: F32x4) -> Mask { sse()._mm_cmplt_ps(a, b) }
    less_or_equal(a: F32x4, b: F32x4) -> Mask { sse()._mm_cmple_ps(a, b) }
    and(a: Mask, b: Mask) -> Mask { sse()._mm_and_ps(a, b) }
    select(mask: Mask, yes: F32x4, no: F32x4) -> F32x4 {
        sse()._mm_or_ps(sse()._mm_and_ps(mask, yes), sse()._mm_andnot_ps(mask, no))
    }
    // A bit for each lane, the lowest for the first.
    lanes(mask: Mask) -> u32 { sse()._mm_movemask_ps(mask).cast_unsigned() }
}

/// a * b + c, rounded once. The sum in f64 decides nearly always; see [`is_doubtful`].
#[inline(always)]
pub(super) fn mul_add(a: F32x4, b: F32x4, c: F32x4) -> F32x4 {
    let low = sum(sse2()._mm_cvtps_pd(a), sse2()._mm_cvtps_pd(b), sse2()._mm_cvtps_pd(c));
    let high = sum(upper(a), upper(b), upper(c));
    if is_doubtful(low, high, c) { joined(exact(a, b, c)) } else { narrow(low, high) }
}

/// Whether a second rounding may go wrong: a sum is midway between two f32, or may be inexact and
/// subnormal. It is exact if c is 0, or if c is 2^-102 or more: product and sum are then multiples
/// of 2^-150.
#[inline(always)]
fn is_doubtful(low: __m128d, high: __m128d, c: F32x4) -> bool {
    let (low, high) = (sse2()._mm_castpd_ps(low), sse2()._mm_castpd_ps(high));
    let ends = sse()._mm_shuffle_ps::<0b10_00_10_00>(low, high);
    // The 29 bits that the second rounding drops.
    let mask = sse2()._mm_set1_epi32(0x1fff_ffff);
    let dropped = sse2()._mm_and_si128(sse2()._mm_castps_si128(ends), mask);
    let is_midway = sse2()._mm_cmpeq_epi32(dropped, sse2()._mm_set1_epi32(0x1000_0000));
    // Twice the bits drop the sign. Subtracting 1 excludes zero, and the comparison of signed
    // numbers stands for one of unsigned numbers.
    let bits = sse2()._mm_castps_si128(c);
    let magnitude = sse2()._mm_add_epi32(bits, bits);
    let shifted = sse2()._mm_add_epi32(magnitude, sse2()._mm_set1_epi32(i32::MAX));
    let limit = sse2()._mm_set1_epi32((2 * TINY.to_bits() - 1).cast_signed() ^ i32::MIN);
    let is_tiny = sse2()._mm_cmplt_epi32(shifted, limit);
    let doubts = sse2()._mm_or_si128(is_midway, is_tiny);
    sse()._mm_movemask_ps(sse2()._mm_castsi128_ps(doubts)) != 0
}

/// 2^-102
const TINY: f32 = f32::from_bits((127 - 102) << 23);

/// [`mul_add`] for doubtful sums. Two integers travel in registers, so that the sums that are not
/// doubtful stay there, too.
#[cold]
#[inline(never)]
fn exact(a: F32x4, b: F32x4, c: F32x4) -> (u64, u64) {
    let [a, b, c] = [a, b, c].map(cast::<_, [f32; 4]>);
    let [low, high] = cast([0, 1, 2, 3].map(|i| super::super::fused::mul_add(a[i], b[i], c[i])));
    (low, high)
}

#[inline(always)]
fn joined((low, high): (u64, u64)) -> F32x4 {
    cast([low, high])
}

/// a * b + c of the f64, in two roundings of which the first is exact.
#[inline(always)]
fn sum(a: __m128d, b: __m128d, c: __m128d) -> __m128d {
    sse2()._mm_add_pd(sse2()._mm_mul_pd(a, b), c)
}

/// The upper half as f64.
#[inline(always)]
fn upper(a: F32x4) -> __m128d {
    sse2()._mm_cvtps_pd(sse()._mm_movehl_ps(a, a))
}

#[inline(always)]
fn narrow(low: __m128d, high: __m128d) -> F32x4 {
    sse()._mm_movelh_ps(sse2()._mm_cvtpd_ps(low), sse2()._mm_cvtpd_ps(high))
}

//! 2^y in f32, from IEEE arithmetic with fused multiply-adds alone, so that all
//! instruction sets agree on it in every bit.

use std::f32::consts::LN_2;

use determinism::simd::Simd;

/// Largest |y|; beyond it, the result stays constant.
pub(crate) const MAX_EXPONENT: f32 = 63.0;
/// Adding this constant rounds to an integer, and leaves that integer plus the bias of exponents
/// in the lowest bits.
const ROUND: f32 = 12_582_912.0 + 127.0;
/// Bits of a significand.
const SIGNIFICAND_BITS: u32 = 23;
/// (2^f - 1) / f for |f| <= 1/2, lowest power first: minimax for the relative
/// error of 2^f, which is 2.0e-9.
pub const COEFFICIENTS: [f32; 6] =
    [LN_2, 0.240_226_48, 0.055_503_324, 0.009_618_437, 0.001_339_887_4, 0.000_153_533_69];

/// s * (1 + q * f) = 2^y, with s a power of two and |f| at most one half.
pub(crate) struct Exp2<V> {
    pub s: V,
    pub q: V,
    pub f: V,
}

/// 2^y in parts, from which other functions than 2^y can be computed without loss. Several vectors
/// are in step: while a processor waits for one polynomial, it computes the others.
#[inline(always)]
pub(crate) fn exp2_parts<S: Simd, const W: usize, const N: usize>(
    simd: S,
    y: &[[S::f32s; W]; N],
) -> Exp2<[[S::f32s; W]; N]> {
    let round = simd.splat_f32s(ROUND);
    let last = simd.splat_f32s(COEFFICIENTS[COEFFICIENTS.len() - 1]);
    let mut parts = Exp2 { s: *y, q: [[last; W]; N], f: *y };
    for row in 0..N {
        for vector in 0..W {
            let y = simd.min_f32s(y[row][vector], simd.splat_f32s(MAX_EXPONENT));
            let y = simd.max_f32s(y, simd.splat_f32s(-MAX_EXPONENT));
            let rounded = simd.add_f32s(y, round);
            parts.f[row][vector] = simd.sub_f32s(y, simd.sub_f32s(rounded, round));
            let exponent = simd.transmute_u32s_f32s(rounded);
            let s = simd.wrapping_dyn_shl_u32s(exponent, simd.splat_u32s(SIGNIFICAND_BITS));
            parts.s[row][vector] = simd.transmute_f32s_u32s(s);
        }
    }
    for power in (0..COEFFICIENTS.len() - 1).rev() {
        let coefficient = simd.splat_f32s(COEFFICIENTS[power]);
        for row in 0..N {
            for vector in 0..W {
                let (q, f) = (parts.q[row][vector], parts.f[row][vector]);
                parts.q[row][vector] = simd.mul_add_f32s(q, f, coefficient);
            }
        }
    }
    parts
}

/// 2^y.
#[inline(always)]
pub(crate) fn exp2<S: Simd>(simd: S, y: S::f32s) -> S::f32s {
    let Exp2 { s: [[s]], q: [[q]], f: [[f]] } = exp2_parts(simd, &[[y]]);
    simd.mul_f32s(s, simd.mul_add_f32s(q, f, simd.splat_f32s(1.0)))
}

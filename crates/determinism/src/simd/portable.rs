//! Vectors of four f32 for processors without a fused multiply-add, with the 128-bit instructions
//! that every x86-64 processor has, or lane by lane.

#[cfg(target_feature = "sse2")]
#[path = "sse2.rs"]
mod instructions;
#[cfg(not(target_feature = "sse2"))]
#[path = "plain.rs"]
mod instructions;

use instructions as vector;
use pulp::bytemuck::cast;

use super::Simd;

/// The level without a fused multiply-add in hardware.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Portable;

impl Simd for Portable {
    // Aligned as f32, so that any slice consists of vectors.
    type f32s = pulp::f32x4;
    type u32s = vector::U32x4;
    type m32s = vector::Mask;
    const IS_FUSED: bool = false;

    #[inline(always)]
    fn splat_f32s(self, value: f32) -> Self::f32s {
        cast(vector::splat(value))
    }
    #[inline(always)]
    fn splat_u32s(self, value: u32) -> Self::u32s {
        vector::splat_bits(value)
    }
    #[inline(always)]
    fn add_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        cast(vector::add(cast(a), cast(b)))
    }
    #[inline(always)]
    fn sub_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        cast(vector::sub(cast(a), cast(b)))
    }
    #[inline(always)]
    fn mul_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        cast(vector::mul(cast(a), cast(b)))
    }
    #[inline(always)]
    fn div_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        cast(vector::div(cast(a), cast(b)))
    }
    #[inline(always)]
    fn mul_add_f32s(self, a: Self::f32s, b: Self::f32s, c: Self::f32s) -> Self::f32s {
        cast(vector::mul_add(cast(a), cast(b), cast(c)))
    }
    #[inline(always)]
    fn min_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        self.select_f32s(vector::less(cast(a), cast(b)), a, b)
    }
    #[inline(always)]
    fn max_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        self.select_f32s(vector::less(cast(b), cast(a)), a, b)
    }
    #[inline(always)]
    fn neg_f32s(self, a: Self::f32s) -> Self::f32s {
        cast(vector::negate(cast(a)))
    }
    #[inline(always)]
    fn and_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::f32s {
        let (a, b) = (cast::<_, [u32; 4]>(a), cast::<_, [u32; 4]>(b));
        cast([a[0] & b[0], a[1] & b[1], a[2] & b[2], a[3] & b[3]])
    }
    #[inline(always)]
    fn sqrt_f32s(self, a: Self::f32s) -> Self::f32s {
        cast(vector::sqrt(cast(a)))
    }
    #[inline(always)]
    fn equal_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::m32s {
        vector::equal(cast(a), cast(b))
    }
    #[inline(always)]
    fn less_than_or_equal_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::m32s {
        vector::less_or_equal(cast(a), cast(b))
    }
    #[inline(always)]
    fn greater_than_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::m32s {
        vector::less(cast(b), cast(a))
    }
    #[inline(always)]
    fn greater_than_or_equal_f32s(self, a: Self::f32s, b: Self::f32s) -> Self::m32s {
        vector::less_or_equal(cast(b), cast(a))
    }
    #[inline(always)]
    fn and_m32s(self, a: Self::m32s, b: Self::m32s) -> Self::m32s {
        vector::and(a, b)
    }
    #[inline(always)]
    fn first_true_m32s(self, mask: Self::m32s) -> usize {
        (vector::lanes(mask) | 1 << 4).trailing_zeros() as usize
    }
    #[inline(always)]
    fn select_f32s(self, mask: Self::m32s, yes: Self::f32s, no: Self::f32s) -> Self::f32s {
        cast(vector::select(mask, cast(yes), cast(no)))
    }
    #[inline(always)]
    fn transmute_u32s_f32s(self, a: Self::f32s) -> Self::u32s {
        cast(a)
    }
    #[inline(always)]
    fn transmute_f32s_u32s(self, a: Self::u32s) -> Self::f32s {
        cast(a)
    }
    #[inline(always)]
    fn wrapping_dyn_shl_u32s(self, a: Self::u32s, n: Self::u32s) -> Self::u32s {
        let (a, n) = (cast::<_, [u32; 4]>(a), cast::<_, [u32; 4]>(n));
        cast([a[0] << (n[0] % 32), a[1] << (n[1] % 32), a[2] << (n[2] % 32), a[3] << (n[3] % 32)])
    }
}

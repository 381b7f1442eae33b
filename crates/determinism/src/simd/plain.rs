//! Vectors of four f32 for any processor.

use std::array::from_fn;

pub(super) type F32x4 = [f32; 4];
pub(super) type U32x4 = [u32; 4];
pub(super) type Mask = [bool; 4];

macro_rules! lane_by_lane {
    ($($name:ident($($argument:ident: $type:ty),*) -> $result:ty { |$i:ident| $value:expr })*) => {
        $(
            #[inline(always)]
            pub(super) fn $name($($argument: $type),*) -> $result {
                from_fn(|$i| $value)
            }
        )*
    };
}

lane_by_lane! {
    splat(value: f32) -> F32x4 { |_i| value }
    splat_bits(value: u32) -> U32x4 { |_i| value }
    add(a: F32x4, b: F32x4) -> F32x4 { |i| a[i] + b[i] }
    sub(a: F32x4, b: F32x4) -> F32x4 { |i| a[i] - b[i] }
    mul(a: F32x4, b: F32x4) -> F32x4 { |i| a[i] * b[i] }
    div(a: F32x4, b: F32x4) -> F32x4 { |i| a[i] / b[i] }
    mul_add(a: F32x4, b: F32x4, c: F32x4) -> F32x4 { |i| super::super::fused::mul_add(a[i], b[i], c[i]) }
    negate(a: F32x4) -> F32x4 { |i| -a[i] }
    sqrt(a: F32x4) -> F32x4 { |i| a[i].sqrt() }
    equal(a: F32x4, b: F32x4) -> Mask { |i| a[i] == b[i] }
    less(a: F32x4, b: F32x4) -> Mask { |i| a[i] < b[i] }
    less_or_equal(a: F32x4, b: F32x4) -> Mask { |i| a[i] <= b[i] }
    and(a: Mask, b: Mask) -> Mask { |i| a[i] & b[i] }
    select(mask: Mask, yes: F32x4, no: F32x4) -> F32x4 { |i| if mask[i] { yes[i] } else { no[i] } }
}

/// A bit for each lane, the lowest for the first.
#[inline(always)]
pub(super) fn lanes(mask: Mask) -> u32 {
    (0..4).map(|i| u32::from(mask[i]) << i).sum()
}

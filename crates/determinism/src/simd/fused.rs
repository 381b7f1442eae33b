//! The fused multiply-add of f32 in software, through f64.
//!
//! The product of two f32 is exact in f64. Its sum with the third is rounded to 53 bits, and then
//! to 24 (fewer for subnormal results). Two roundings differ from one only if the first one ends
//! midway between two f32 and was not exact; [`mul_add`] therefore rounds the sum *to odd*: an
//! inexact sum gets the neighbour whose last bit is 1, which is midway between no two f32.

/// a * b + c, rounded once: the bits of [`f32::mul_add`], except the payload of NaN.
#[inline(always)]
pub fn mul_add(a: f32, b: f32, c: f32) -> f32 {
    let (product, c) = (f64::from(a) * f64::from(b), f64::from(c));
    let sum = product + c;
    // TwoSum (Knuth): the sum plus (high - low) is exact. An infinity leaves NaN, which is neither
    // above nor below.
    let of_c = sum - product;
    let (high, low) = (product - (sum - of_c), of_c - c);
    let is_above = high > low;
    let is_below = high < low;
    let shrinks = if sum > 0.0 { is_below } else { is_above };
    // Towards zero, then to odd.
    let truncated = sum.to_bits() - u64::from(shrinks);
    f64::from_bits(truncated | u64::from(is_above | is_below)) as f32
}

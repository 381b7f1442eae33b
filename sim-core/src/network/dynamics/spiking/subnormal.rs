//! Detours around subnormal numbers, with the bits of plain arithmetic.
//!
//! What opens by a spike and closes exponentially becomes smaller than 2^-126 in silence, and stays
//! there: the smallest numbers times 0.9 round to themselves. A product with such a *subnormal*
//! number costs a processor of Intel a hundred cycles and more; a sum or a comparison does not. So
//! [`product`] computes the same bits from numbers that are large enough. For sums of products,
//! [`bounds`] encloses the numbers, and all later operations keep the bounds in order: they are
//! monotone, and so is their rounding. Where results from both bounds agree, the exact numbers have
//! the same result.

use determinism::simd::Simd;

use super::row::{Mask, Row};

/// 2^-100. Numbers above zero and below this take detours. A product of a larger number with
/// everyday factors is not subnormal.
const TINY: f32 = power_of_two(-100);
/// The smallest number that is not subnormal: 2^-126.
const NORMAL: f32 = f32::MIN_POSITIVE;
/// Scales the subnormal numbers, multiples of 2^-149, to multiples of 2^-89.
const SCALE: f32 = power_of_two(60);
/// The bits of a number that are not its sign or exponent.
const MANTISSA: f32 = f32::from_bits(0x007f_ffff);

const fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
}

/// Where a number, not negative, may need a detour.
#[inline(always)]
pub(super) fn is_tiny<S: Simd, const W: usize>(x: Row<S, W>) -> Mask<S, W> {
    x.exceeds(x.constant(0.0)).and(x.constant(TINY).exceeds(x))
}

/// Bounds of a number, not negative, of which neither is subnormal.
#[inline(always)]
pub(super) fn bounds<S: Simd, const W: usize>(x: Row<S, W>) -> [Row<S, W>; 2] {
    [x.reaches(x.constant(TINY)).select(x, x.constant(0.0)), x.at_least(TINY)]
}

/// Where two bounds leave no doubt about a number's bits: they are equal and not 0, which has two
/// signs.
#[inline(always)]
pub(super) fn agree<S: Simd, const W: usize>([low, high]: [Row<S, W>; 2]) -> Mask<S, W> {
    let zero = low.constant(0.0);
    low.equals(high).and(zero.exceeds(low.min(-low)))
}

/// x times a factor, both in \[0, 1\], by a detour if DETOUR.
#[inline(always)]
pub(super) fn product<S: Simd, const W: usize, const DETOUR: bool>(
    x: Row<S, W>,
    factor: Row<S, W>,
) -> Row<S, W> {
    if DETOUR { product_of_scaled(x, factor) } else { x * factor }
}

/// The multiply-add of the scaled x adds 2^-66, and so rounds to multiples of 2^-89, as a product
/// without the scale rounds to multiples of 2^-149. It ends in \[2^-66, 2^-65): scaled back, its
/// exponent is that of 2^-126, and its other bits are the subnormal product.
#[inline(always)]
fn product_of_scaled<S: Simd, const W: usize>(x: Row<S, W>, factor: Row<S, W>) -> Row<S, W> {
    let (zero, normal) = (x.constant(0.0), x.constant(NORMAL));
    let (scale, scaled_normal) = (x.constant(SCALE), x.constant(NORMAL * SCALE));
    let is_subnormal = normal.exceeds(x);
    let scaled = (x + is_subnormal.select(normal, zero)) * scale;
    let scaled = scaled - is_subnormal.select(scaled_normal, zero);

    let above = scaled.mul_add(factor, scaled_normal);
    let back = x.constant(1.0 / SCALE);
    let subnormal = (above * back).common_bits(x.constant(MANTISSA));
    // At least 2^-66, so that no processor makes a subnormal product that `select` drops.
    let other = (scaled * factor).max(scaled_normal) * back;
    x.constant(2.0 * NORMAL * SCALE).exceeds(above).select(subnormal, other)
}

/// The next value of s, which x raises towards 1, and which decays: s + (rise x (1 - s) - decay s).
/// All are in \[0, 1\].
#[inline(always)]
pub(super) fn risen<S: Simd, const W: usize, const DETOUR: bool>(
    s: Row<S, W>,
    x: Row<S, W>,
    [rise, decay]: [Row<S, W>; 2],
) -> Row<S, W> {
    let rising = product::<S, W, DETOUR>(product::<S, W, DETOUR>(x, rise), s.constant(1.0) - s);
    s + (rising - product::<S, W, DETOUR>(s, decay))
}

#[cfg(test)]
mod tests {
    use determinism::Isa;
    use determinism::random::{Purpose, Stream};
    use determinism::simd::{WithSimd, bytemuck};

    use super::*;

    /// The first number between its bounds, and both ways to compute a product and a rise.
    struct Both<'a>([&'a [f32]; 3]);

    impl WithSimd for Both<'_> {
        type Output = Vec<[Vec<f32>; 7]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let [x, factor, other] = self.0.map(|values| S::as_simd_f32s(values).0);
            let rows = x.iter().zip(factor).zip(other).map(|((x, factor), other)| {
                let [x, factor, other] = [x, factor, other].map(|row| Row::new(simd, [*row]));
                let [low, high] = bounds(x);
                let rates = [factor, other];
                let detour = product::<S, 1, true>(x, factor);
                let plain = product::<S, 1, false>(x, factor);
                let risen_by_detour = risen::<S, 1, true>(x, other, rates);
                let plainly_risen = risen::<S, 1, false>(x, other, rates);
                let rows = [low, x, high, detour, plain, risen_by_detour, plainly_risen];
                rows.map(|row| bytemuck::cast_slice(&row.vectors).to_vec())
            });
            rows.collect()
        }
    }

    /// A number in \[0, 1\]: any, one of few bits, one near the border of subnormal numbers, or one
    /// of the smallest.
    fn number(stream: &mut Stream) -> f32 {
        let random = (stream.uniform() * (1_u64 << 53) as f64) as u64;
        let (bits, kind) = ((random >> 8) as u32, random % 6);
        let one = 1.0_f32.to_bits();
        match kind {
            0 => f32::from_bits(bits % (one + 1)),
            1 => 1.0 - f32::from_bits(bits % (one + 1)),
            2 => f32::from_bits((bits & 0x3ff0_0000) % (one + 1)),
            3 => f32::from_bits(bits % 0x0180_0000),
            4 => f32::from_bits(bits % 64),
            _ => f32::from_bits(0x0080_0000 + bits % 128 - 64),
        }
    }

    #[test]
    fn detours_have_the_bits_of_plain_arithmetic() {
        let mut stream = Stream::new(1, 0_u64, 0, Purpose::Script, 0);
        for _ in 0..200 {
            let mut numbers = || -> Vec<f32> { (0..1_024).map(|_| number(&mut stream)).collect() };
            let [x, factor, other] = [numbers(), numbers(), numbers()];
            for isa in Isa::available() {
                for rows in isa.run(Both([&x, &factor, &other])) {
                    let [low, x, high, detour, plain, risen, plainly] = rows;
                    let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    assert_eq!(bits(&detour), bits(&plain), "{isa}");
                    assert_eq!(bits(&risen), bits(&plainly), "{isa}");
                    for ((low, x), high) in low.into_iter().zip(x).zip(high) {
                        let is_fit = |bound: f32| bound == 0.0 || bound >= TINY;
                        assert!(is_fit(low) && low <= x && x <= high && is_fit(high), "{x:e}");
                    }
                }
            }
        }
    }
}

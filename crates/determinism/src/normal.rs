//! Quantiles of the standard normal distribution, one by one and many at once, with the same bits.

use crate::Isa;
use crate::simd::{Simd, WithSimd};

/// Replaces probabilities in (0, 1) by the corresponding quantiles of N(0, 1).
pub fn standard_normal_quantiles(probabilities: &mut [f64]) {
    Isa::best().run(StandardNormalQuantiles(probabilities));
}

/// Quantile of N(0, 1) at `p` in (0, 1); Wichura, "Algorithm AS 241: The
/// Percentage Points of the Normal Distribution", Applied Statistics 37 (1988),
/// routine PPND16, relative accuracy about 1e-16.
pub(crate) fn standard_normal_quantile(p: f64) -> f64 {
    let q = p - 0.5;
    if is_central(q) {
        return central_quantile(q);
    }
    let r = (-libm::log(tail_of(p))).sqrt();
    let magnitude = if r <= MIDDLE_MAX {
        middle_quantile(r)
    } else {
        let r = r - 5.0;
        horner(&TAIL_NUMERATOR, r) / horner(&TAIL_DENOMINATOR, r)
    };
    if q < 0.0 { -magnitude } else { magnitude }
}

/// The smaller of `p` and 1 - `p`.
#[inline(always)]
fn tail_of(p: f64) -> f64 {
    if p - 0.5 < 0.0 { p } else { 1.0 - p }
}

/// The square root of minus the logarithm of a tail up to which the middle polynomials hold. A
/// probability is beyond it once in 36,000,000,000 draws.
const MIDDLE_MAX: f64 = 5.0;

#[inline(always)]
fn middle_quantile(r: f64) -> f64 {
    let r = r - 1.6;
    horner(&MIDDLE_NUMERATOR, r) / horner(&MIDDLE_DENOMINATOR, r)
}

/// The natural logarithm of a number in \[2^-53, 1/2\], with the operations of `libm::log` in the
/// same order, so that it has the same bits, and without its branches.
#[inline(always)]
fn log_of_tail(x: f64) -> f64 {
    // The high words of 1 and of sqrt(1/2).
    const ONE: u64 = 0x3ff0_0000 << 32;
    const ROOT: u64 = 0x3fe6_a09e << 32;
    const MANTISSA: u64 = (1 << 52) - 1;
    // The bits of 2^52, into which whole numbers are added.
    const WHOLE: u64 = 0x433 << 52;
    let shifted = x.to_bits() + (ONE - ROOT);
    let k = f64::from_bits(WHOLE | (shifted >> 52)) - f64::from_bits(WHOLE) - 1023.0;
    let f = f64::from_bits((shifted & MANTISSA) + ROOT) - 1.0;
    let half_square = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let [g1, g2, g3, g4, g5, g6, g7] = LOG;
    let even = w * (g2 + w * (g4 + w * g6));
    let odd = z * (g1 + w * (g3 + w * (g5 + w * g7)));
    s * (half_square + (odd + even)) + k * LN_2_LOW - half_square + f + k * LN_2_HIGH
}

const LN_2_HIGH: f64 = f64::from_bits(0x3fe6_2e42_fee0_0000);
const LN_2_LOW: f64 = f64::from_bits(0x3dea_39ef_3579_3c76);
const LOG: [f64; 7] = [
    f64::from_bits(0x3fe5_5555_5555_5593),
    f64::from_bits(0x3fd9_9999_9997_fa04),
    f64::from_bits(0x3fd2_4924_9422_9359),
    f64::from_bits(0x3fcc_71c5_1d8e_78af),
    f64::from_bits(0x3fc7_4664_96cb_03de),
    f64::from_bits(0x3fc3_9a09_d078_c69f),
    f64::from_bits(0x3fc2_f112_df3e_5244),
];

/// Whether `p` = q + 0.5 is in the central region, as 85 % of uniform probabilities are.
fn is_central(q: f64) -> bool {
    q.abs() <= 0.425
}

#[inline(always)]
fn central_quantile(q: f64) -> f64 {
    let r = 0.180625 - q * q;
    q * horner(&CENTRE_NUMERATOR, r) / horner(&CENTRE_DENOMINATOR, r)
}

/// Replaces probabilities by their quantiles. It first treats all of them as central, and then
/// collects those that are not, because the compiler vectorises loops without branches.
pub(crate) struct StandardNormalQuantiles<'a>(pub &'a mut [f64]);

impl WithSimd for StandardNormalQuantiles<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        const N: usize = 256;
        let mut probabilities = [0.5; N];
        let mut tails = [0; N];
        for values in self.0.chunks_mut(N) {
            let probabilities = &mut probabilities[..values.len()];
            probabilities.copy_from_slice(values);
            for (value, p) in values.iter_mut().zip(&*probabilities) {
                *value = central_quantile(p - 0.5);
            }
            let mut n_tails = 0;
            for (place, p) in probabilities.iter().enumerate() {
                tails[n_tails] = place;
                n_tails += usize::from(!is_central(p - 0.5));
            }
            tail_quantiles(values, probabilities, &tails[..n_tails]);
        }
    }
}

/// Replaces the values at these places by the quantiles of probabilities beyond the central region.
#[inline(always)]
fn tail_quantiles(values: &mut [f64], probabilities: &[f64], places: &[usize]) {
    const N: usize = 32;
    for places in places.chunks(N) {
        let mut p = [0.01; N];
        p.iter_mut().zip(places).for_each(|(p, &place)| *p = probabilities[place]);
        // Loops, because the closures of `map` are not compiled for this instruction set.
        let (mut r, mut quantiles) = ([0.0; N], [0.0; N]);
        for (r, p) in r.iter_mut().zip(p) {
            *r = (-log_of_tail(tail_of(p))).sqrt();
        }
        for ((quantile, r), p) in quantiles.iter_mut().zip(r).zip(p) {
            *quantile = middle_quantile(r).copysign(p - 0.5);
        }
        places.iter().zip(quantiles).for_each(|(&place, quantile)| values[place] = quantile);
        if r.iter().any(|r| *r > MIDDLE_MAX) {
            replace_far_tails(values, probabilities, places);
        }
    }
}

/// The same one by one, out of the way of the common case.
#[cold]
#[inline(never)]
fn replace_far_tails(values: &mut [f64], probabilities: &[f64], places: &[usize]) {
    places.iter().for_each(|&place| values[place] = standard_normal_quantile(probabilities[place]));
}

/// Polynomial with the coefficients of x^0, x^1, ...
#[inline(always)]
fn horner(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

const CENTRE_NUMERATOR: [f64; 8] = [
    3.387_132_872_796_366_5,
    1.331_416_678_917_843_8e2,
    1.971_590_950_306_551_3e3,
    1.373_169_376_550_946e4,
    4.592_195_393_154_987e4,
    6.726_577_092_700_87e4,
    3.343_057_558_358_813e4,
    2.509_080_928_730_122_7e3,
];
const CENTRE_DENOMINATOR: [f64; 8] = [
    1.0,
    4.231_333_070_160_091e1,
    6.871_870_074_920_579e2,
    5.394_196_021_424_751e3,
    2.121_379_430_158_66e4,
    3.930_789_580_009_271e4,
    2.872_908_573_572_194_3e4,
    5.226_495_278_852_854e3,
];
const MIDDLE_NUMERATOR: [f64; 8] = [
    1.423_437_110_749_683_5,
    4.630_337_846_156_546,
    5.769_497_221_460_691,
    3.647_848_324_763_204_5,
    1.270_458_252_452_368_4,
    2.417_807_251_774_506e-1,
    2.272_384_498_926_918_4e-2,
    7.745_450_142_783_414e-4,
];
const MIDDLE_DENOMINATOR: [f64; 8] = [
    1.0,
    2.053_191_626_637_759,
    1.676_384_830_183_803_8,
    6.897_673_349_851e-1,
    1.481_039_764_274_800_8e-1,
    1.519_866_656_361_645_7e-2,
    5.475_938_084_995_345e-4,
    1.050_750_071_644_416_9e-9,
];
const TAIL_NUMERATOR: [f64; 8] = [
    6.657_904_643_501_103,
    5.463_784_911_164_114,
    1.784_826_539_917_291_3,
    2.965_605_718_285_048_7e-1,
    2.653_218_952_657_612_4e-2,
    1.242_660_947_388_078_4e-3,
    2.711_555_568_743_487_6e-5,
    2.010_334_399_292_288_1e-7,
];
const TAIL_DENOMINATOR: [f64; 8] = [
    1.0,
    5.998_322_065_558_88e-1,
    1.369_298_809_227_358e-1,
    1.487_536_129_085_061_5e-2,
    7.868_691_311_456_133e-4,
    1.846_318_317_510_054_8e-5,
    1.421_511_758_316_446e-7,
    2.044_263_103_389_939_8e-15,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream, TWO_POW_MINUS_53};

    #[test]
    fn quantiles_match_tables() {
        // scipy.stats.norm.ppf
        for (p, expected) in [
            (0.5, 0.0),
            (0.025, -1.959963984540054),
            (0.975, 1.959963984540054),
            (1e-10, -6.361340902404056),
            (0.3, -0.5244005127080409),
            (1e-16, -8.222082216130435),
        ] {
            let q = standard_normal_quantile(p);
            assert!((q - expected).abs() <= 1e-14 * expected.abs().max(1.0), "{p}: {q} {expected}");
        }
    }

    #[test]
    fn logarithms_of_tails_have_the_bits_of_the_library() {
        let mut stream = Stream::new(3, 0, 0, Purpose::Evolution, 0);
        let mut tail = || stream.uniform() * libm::exp2(-40.0 * stream.uniform()) / 2.0;
        let drawn = (0..200_000).map(|_| tail());
        for x in drawn.chain([0.5, 0.5f64.next_down(), 0.25, TWO_POW_MINUS_53, 0.075]) {
            let x = x.max(TWO_POW_MINUS_53);
            assert_eq!(log_of_tail(x).to_bits(), libm::log(x).to_bits(), "{x}");
        }
    }

    #[test]
    fn quantiles_at_once_have_the_bits_of_single_ones() {
        let smallest = TWO_POW_MINUS_53;
        let mut expected: Vec<f64> = (0..2000).map(|k| (f64::from(k) + 0.5) / 2000.0).collect();
        expected.extend([smallest, 1.0 - smallest, 1e-12, 1.0 - 1e-12, 0.075, 0.925, 0.5]);
        for isa in Isa::available() {
            let mut found = expected.clone();
            isa.run(StandardNormalQuantiles(&mut found));
            for (found, p) in found.iter().zip(&expected) {
                assert_eq!(found.to_bits(), standard_normal_quantile(*p).to_bits(), "{p} {isa}");
            }
        }
    }
}

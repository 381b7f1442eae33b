//! Functions of the neuron models, from IEEE arithmetic with fused multiply-adds alone.
//!
//! Relative errors: 3e-6 of exp and cosh for |x| <= 43, beyond which exp stays at about 2^63 or
//! 2^-63; 3e-7 of tanh.

use std::f32::consts::LOG2_E;

use determinism::simd::Simd;

use super::row::Row;
use crate::exp2::{Exp2, exp2_parts};

/// e^x
#[inline(always)]
pub(super) fn exp<S: Simd, const W: usize>(x: Row<S, W>) -> Row<S, W> {
    let (one, [s, q, f]) = (x.constant(1.0), exp2_of(x, LOG2_E));
    s * q.mul_add(f, one)
}

/// (e^2x - 1) / (e^2x + 1); near 0 nothing cancels.
#[inline(always)]
pub(super) fn tanh<S: Simd, const W: usize>(x: Row<S, W>) -> Row<S, W> {
    let (one, [s, q, f]) = (x.constant(1.0), exp2_of(x, 2.0 * LOG2_E));
    let above = s.mul_add(q * f, s - one);
    above / (above + x.constant(2.0))
}

/// (e^x + e^-x) / 2
#[inline(always)]
pub(super) fn cosh<S: Simd, const W: usize>(x: Row<S, W>) -> Row<S, W> {
    x.constant(0.5) * (exp(x) + exp(-x))
}

/// s, q and f of [`Exp2`] for 2^(factor x).
#[inline(always)]
fn exp2_of<S: Simd, const W: usize>(x: Row<S, W>, factor: f32) -> [Row<S, W>; 3] {
    let simd = x.simd;
    let Exp2 { s: [s], q: [q], f: [f] } = exp2_parts(simd, &[(x * x.constant(factor)).vectors]);
    [Row::new(simd, s), Row::new(simd, q), Row::new(simd, f)]
}

#[cfg(test)]
mod tests {
    use determinism::simd::{WithSimd, bytemuck};

    use super::*;
    use determinism::Isa;

    /// exp, tanh and cosh of whole vectors of x.
    struct Functions<'a>(&'a [f32]);

    impl WithSimd for Functions<'_> {
        type Output = Vec<[f32; 3]>;

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let lanes = self.0.chunks_exact(S::F32_LANES).flat_map(|x| {
                let x = S::as_simd_f32s(x).0[0];
                let x = Row::new(simd, [x]);
                let all = [exp(x), tanh(x), cosh(x)].map(|row| row.vectors[0]);
                let all: &[f32] = bytemuck::cast_slice(&all);
                let lane = |i: usize| [0, 1, 2].map(|function| all[function * S::F32_LANES + i]);
                (0..S::F32_LANES).map(lane).collect::<Vec<_>>()
            });
            lanes.collect()
        }
    }

    /// Every 997th float of both signs, up to 43.
    fn sample() -> Vec<f32> {
        let magnitudes = (0..=43.0_f32.to_bits()).step_by(997).map(f32::from_bits);
        let mut sample: Vec<f32> = magnitudes.flat_map(|x| [x, -x]).collect();
        sample.resize(sample.len().next_multiple_of(64), 0.0);
        sample
    }

    #[test]
    fn functions_are_accurate() {
        let sample = sample();
        for (&x, computed) in sample.iter().zip(Isa::best().run(Functions(&sample))) {
            let exact = f64::from(x);
            let [exp, tanh, cosh] = computed.map(f64::from);
            assert!((exp / libm::exp(exact) - 1.0).abs() < 3e-6, "exp {x}");
            assert!((tanh - libm::tanh(exact)).abs() < 3e-7, "tanh {x}");
            assert!((cosh / libm::cosh(exact) - 1.0).abs() < 3e-6, "cosh {x}");
        }
    }

    #[test]
    fn functions_of_any_argument_are_numbers() {
        let large = [f32::MAX; 64];
        let small = [f32::MIN; 64];
        for x in [large, small] {
            assert!(Isa::best().run(Functions(&x)).as_flattened().iter().all(|y| y.is_finite()));
        }
    }

    #[test]
    fn instruction_sets_agree_in_every_bit() {
        let sample = sample();
        let bits = |isa: Isa| -> Vec<[u32; 3]> {
            let computed = isa.run(Functions(&sample));
            computed.into_iter().map(|values| values.map(f32::to_bits)).collect()
        };
        for isa in Isa::available() {
            assert!(bits(isa) == bits(Isa::best()), "{isa} differs from {}", Isa::best());
        }
    }
}

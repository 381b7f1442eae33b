//! The activation functions, for two neurons at a time.
//!
//! Both functions are ratios of expressions in 2^y, where y is the argument scaled by
//! [`scale`]: sigmoid(x) = 1 / (1 + 2^y) and tanh(x) = (2^y - 1) / (2^y + 1). One
//! division serves two neurons: a/b and c/d are a*d and c*b over b*d. Everything
//! is IEEE arithmetic with fused multiply-adds, so all instruction sets agree.
//!
//! Errors, for any y of the other neuron: sigmoid 3.5 ulp, down to 2^-63, where it stays
//! constant; tanh 4.5 ulp.

use std::f64::consts::LOG2_E;

use determinism::Isa;
use determinism::simd::{Simd, WithSimd, bytemuck};

use crate::exp2::{Exp2, exp2_parts};
use experiment_file::Activation;

/// y for an argument of 1.
pub(super) fn scale(activation: Activation) -> f64 {
    match activation {
        Activation::Sigmoid => -LOG2_E,
        Activation::Tanh => 2.0 * LOG2_E,
    }
}

/// u = F(y) of a pair of neurons in one lane.
pub(super) fn squash_in_one_lane(isa: Isa, activation: Activation, y: [f32; 2]) -> [f32; 2] {
    isa.run(Pair { activation, y })
}

struct Pair {
    activation: Activation,
    y: [f32; 2],
}

impl WithSimd for Pair {
    type Output = [f32; 2];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [f32; 2] {
        let y = [[simd.splat_f32s(self.y[0])], [simd.splat_f32s(self.y[1])]];
        let mut u = y;
        squash(simd, self.activation, &y, &mut u);
        [bytemuck::cast_slice(&u[0])[0], bytemuck::cast_slice(&u[1])[0]]
    }
}

/// u = F(y) of neurons in W vectors of lanes, pair by pair.
#[inline(always)]
pub(super) fn squash<S: Simd, const W: usize, const N: usize>(
    simd: S,
    activation: Activation,
    y: &[[S::f32s; W]; N],
    u: &mut [[S::f32s; W]; N],
) {
    for (y, u) in y.as_chunks::<2>().0.iter().zip(u.as_chunks_mut::<2>().0) {
        squash_pair(simd, activation, y, u);
    }
}

/// u = F(y) of a pair. In wide rows, two or three vectors of both neurons are in step: fewer leave
/// the processor waiting for a polynomial, and more do not fit in sixteen registers.
#[inline(always)]
fn squash_pair<S: Simd, const W: usize>(
    simd: S,
    activation: Activation,
    y: &[[S::f32s; W]; 2],
    u: &mut [[S::f32s; W]; 2],
) {
    match W {
        4 => {
            squash_part::<S, W, 2>(simd, activation, y, u, 0);
            squash_part::<S, W, 2>(simd, activation, y, u, 2);
        }
        5 => {
            squash_part::<S, W, 3>(simd, activation, y, u, 0);
            squash_part::<S, W, 2>(simd, activation, y, u, 3);
        }
        6 => {
            squash_part::<S, W, 3>(simd, activation, y, u, 0);
            squash_part::<S, W, 3>(simd, activation, y, u, 3);
        }
        _ => {
            *u = match activation {
                Activation::Sigmoid => {
                    let [a] = one_plus_exp2(simd, &[y[0]]);
                    let [b] = one_plus_exp2(simd, &[y[1]]);
                    sigmoid(simd, [a, b])
                }
                Activation::Tanh => {
                    let [a] = exp2_minus_one(simd, &[y[0]]);
                    let [b] = exp2_minus_one(simd, &[y[1]]);
                    tanh(simd, [a, b])
                }
            }
        }
    }
}

/// u = F(y) of V vectors of a pair, from `first` on.
#[inline(always)]
fn squash_part<S: Simd, const W: usize, const V: usize>(
    simd: S,
    activation: Activation,
    y: &[[S::f32s; W]; 2],
    u: &mut [[S::f32s; W]; 2],
    first: usize,
) {
    let mut part = [[y[0][0]; V]; 2];
    for (part, y) in part.iter_mut().zip(y) {
        part.copy_from_slice(&y[first..first + V]);
    }
    let part = match activation {
        Activation::Sigmoid => sigmoid(simd, one_plus_exp2(simd, &part)),
        Activation::Tanh => tanh(simd, exp2_minus_one(simd, &part)),
    };
    for (part, u) in part.iter().zip(u) {
        u[first..first + V].copy_from_slice(part);
    }
}

/// 1 / (1 + 2^y) from 1 + 2^y, twice.
#[inline(always)]
fn sigmoid<S: Simd, const W: usize>(simd: S, sums: [[S::f32s; W]; 2]) -> [[S::f32s; W]; 2] {
    let [mut a, mut b] = sums;
    for vector in 0..W {
        let product = simd.mul_f32s(a[vector], b[vector]);
        let inverse = simd.div_f32s(simd.splat_f32s(1.0), product);
        (a[vector], b[vector]) =
            (simd.mul_f32s(b[vector], inverse), simd.mul_f32s(a[vector], inverse));
    }
    [a, b]
}

/// 1 + 2^y of N neurons in step.
#[inline(always)]
fn one_plus_exp2<S: Simd, const W: usize, const N: usize>(
    simd: S,
    y: &[[S::f32s; W]; N],
) -> [[S::f32s; W]; N] {
    let one = simd.splat_f32s(1.0);
    let Exp2 { s, mut q, f } = exp2_parts(simd, y);
    for (q, f) in q.iter_mut().zip(f) {
        for vector in 0..W {
            q[vector] = simd.mul_add_f32s(q[vector], f[vector], one);
        }
    }
    for (q, s) in q.iter_mut().zip(s) {
        for vector in 0..W {
            q[vector] = simd.mul_add_f32s(s[vector], q[vector], one);
        }
    }
    q
}

/// (2^y - 1) / (2^y + 1) from 2^y - 1, twice.
#[inline(always)]
fn tanh<S: Simd, const W: usize>(simd: S, above: [[S::f32s; W]; 2]) -> [[S::f32s; W]; 2] {
    let [mut above_a, mut above_b] = above;
    let two = simd.splat_f32s(2.0);
    for vector in 0..W {
        let a = simd.add_f32s(above_a[vector], two);
        let b = simd.add_f32s(above_b[vector], two);
        let inverse = simd.div_f32s(simd.splat_f32s(1.0), simd.mul_f32s(a, b));
        above_a[vector] = simd.mul_f32s(above_a[vector], simd.mul_f32s(b, inverse));
        above_b[vector] = simd.mul_f32s(above_b[vector], simd.mul_f32s(a, inverse));
    }
    [above_a, above_b]
}

/// 2^y - 1 of N neurons in step. Near y = 0, s is 1 and nothing cancels.
#[inline(always)]
fn exp2_minus_one<S: Simd, const W: usize, const N: usize>(
    simd: S,
    y: &[[S::f32s; W]; N],
) -> [[S::f32s; W]; N] {
    let one = simd.splat_f32s(1.0);
    let Exp2 { s, mut q, f } = exp2_parts(simd, y);
    for (q, (s, f)) in q.iter_mut().zip(s.iter().zip(f)) {
        for vector in 0..W {
            let above = simd.sub_f32s(s[vector], one);
            q[vector] = simd.mul_add_f32s(s[vector], simd.mul_f32s(q[vector], f[vector]), above);
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use determinism::simd::{WithSimd, bytemuck};

    use super::*;
    use crate::exp2::MAX_EXPONENT;
    use determinism::Isa;

    /// Both activation functions of every y of a slice, each paired with some other y.
    struct Squash<'a> {
        activation: Activation,
        y: &'a [f32],
        other: f32,
    }

    impl WithSimd for Squash<'_> {
        type Output = Vec<[f32; 2]>;

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let lanes = self.y.chunks_exact(S::F32_LANES).flat_map(|y| {
                let pair = [S::as_simd_f32s(y).0[0], simd.splat_f32s(self.other)];
                let mut activity = pair.map(|y| [y]);
                squash(simd, self.activation, &pair.map(|y| [y]), &mut activity);
                let [u, other] = &activity;
                let (u, other) = (bytemuck::cast_slice(u), bytemuck::cast_slice(other));
                let both = u.iter().zip(other).map(|(&u, &other): (&f32, &f32)| [u, other]);
                both.collect::<Vec<_>>()
            });
            lanes.collect()
        }
    }

    /// Every 997th float of both signs, up to 2^7.
    fn sample() -> Vec<f32> {
        let magnitudes = (0..=128.0_f32.to_bits()).step_by(997).map(f32::from_bits);
        let mut sample: Vec<f32> = magnitudes.flat_map(|y| [y, -y]).collect();
        sample.resize(sample.len().next_multiple_of(64), 0.0);
        sample
    }

    /// Largest error of an activation function, in ulp of its exact value.
    fn error_ulp(activation: Activation, exact: impl Fn(f64) -> f64) -> f64 {
        let mut largest = 0.0;
        let y = sample();
        for other in [-200.0, -1.5, 0.25, 200.0] {
            let computed = Isa::best().run(Squash { activation, y: &y, other });
            for (&y, [u, other_u]) in y.iter().zip(computed) {
                for (y, u) in [(y, u), (other, other_u)] {
                    let exact = exact(f64::from(y.clamp(-MAX_EXPONENT, MAX_EXPONENT)));
                    let exponent = ((exact as f32).to_bits() >> 23 & 0xff) as i32;
                    let ulp = libm::exp2(f64::from(exponent.max(1) - 127 - 23));
                    largest = f64::max(largest, (f64::from(u) - exact).abs() / ulp);
                }
            }
        }
        largest
    }

    #[test]
    fn sigmoid_is_accurate() {
        let error = error_ulp(Activation::Sigmoid, |y| 1.0 / (1.0 + libm::exp2(y)));
        assert!(error < 3.5, "{error}");
    }

    #[test]
    fn tanh_is_accurate() {
        let error = error_ulp(Activation::Tanh, |y| libm::tanh(y / (2.0 * LOG2_E)));
        assert!(error < 4.5, "{error}");
    }

    #[test]
    fn saturated_neurons_stay_in_range() {
        let y = [f32::MAX; 64];
        for (activation, low, high) in
            [(Activation::Sigmoid, 0.0, 1.0), (Activation::Tanh, 1.0, -1.0)]
        {
            for isa in Isa::available() {
                let computed = isa.run(Squash { activation, y: &y, other: f32::MIN });
                for [above, below] in computed {
                    assert!((above - low).abs() < 1e-18 && (below - high).abs() < 1e-18, "{isa}");
                }
            }
        }
    }

    #[test]
    fn instruction_sets_agree_in_every_bit() {
        let y = sample();
        for activation in [Activation::Sigmoid, Activation::Tanh] {
            let bits = |isa: Isa| -> Vec<[u32; 2]> {
                let computed = isa.run(Squash { activation, y: &y, other: 0.7 });
                computed.into_iter().map(|pair| pair.map(f32::to_bits)).collect()
            };
            for isa in Isa::available() {
                assert!(bits(isa) == bits(Isa::best()), "{isa} differs from {}", Isa::best());
            }
        }
    }
}

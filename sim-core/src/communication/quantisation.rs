//! Quantises messages to symbols of a lattice (Eq. 3.13 and 3.14, Algorithm 4).

use std::f64::consts::LOG2_E;

use determinism::simd::{Simd, WithSimd};

use crate::blueprint::Lattice;
use crate::exp2::exp2;
use determinism::Isa;

/// Draws lattice points with probabilities softmax(-beta * d / sqrt(M)), d the Euclidean distance
/// to the message. Computes in f32, with one lane per robot, so probabilities are accurate to about
/// 1e-5.
#[derive(Debug, Clone)]
pub(crate) struct Quantiser {
    /// A point's weight is 2^(slope * distance), up to a common factor.
    slope: f32,
    message_len: usize,
    n_levels: usize,
    /// `[point][component]`, row-major: the last component runs fastest.
    points: Vec<f64>,
}

/// Scratch memory of a quantiser.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch(Vec<f32>);

impl Quantiser {
    /// The lattice of messages of length M = `message_len` with K = `n_levels` >= 2 levels
    /// i/(K-1) per component.
    pub fn new(message_len: usize, n_levels: usize, beta: f64) -> Self {
        debug_assert!(n_levels >= 2, "a single level carries no information");
        let n_points = (0..message_len).fold(1, |n, _| n * n_levels);
        let mut points = vec![0.0; n_points * message_len];
        for (index, point) in points.chunks_exact_mut(message_len).enumerate() {
            let mut rest = index;
            for component in point.iter_mut().rev() {
                *component = (rest % n_levels) as f64 / (n_levels - 1) as f64;
                rest /= n_levels;
            }
        }
        let slope = (-beta * LOG2_E / (message_len as f64).sqrt()) as f32;
        Self { slope, message_len, n_levels, points }
    }

    /// The lattice as numbers.
    pub fn lattice(&self) -> Lattice {
        let level = |index| index as f64 / (self.n_levels - 1) as f64;
        Lattice { slope: self.slope, levels: (0..self.n_levels).map(level).collect() }
    }

    /// Replaces the messages `[robot][component]`, clipped to \[0, 1\], by the
    /// lattice points that the robots' `u`, uniform in \[0, 1), draw.
    pub fn quantise(&self, isa: Isa, messages: &mut [f64], u: &[f64], scratch: &mut Scratch) {
        let lanes = isa.vector_len();
        let robots = messages.chunks_mut(lanes * self.message_len).zip(u.chunks(lanes));
        for (messages, u) in robots {
            isa.run(Quantise { quantiser: self, messages, u, scratch });
        }
    }
}

/// Quantises the messages of at most one vector of robots.
struct Quantise<'a> {
    quantiser: &'a Quantiser,
    messages: &'a mut [f64],
    u: &'a [f64],
    scratch: &'a mut Scratch,
}

impl WithSimd for Quantise<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { quantiser, messages, u, scratch: Scratch(memory) } = self;
        let n_components = quantiser.message_len;
        let n_points = quantiser.points.len() / n_components;
        memory.clear();
        memory.resize((n_components + 1 + n_points) * S::F32_LANES, 0.0);
        let (rows, weights) = memory.split_at_mut((n_components + 1) * S::F32_LANES);
        for (index, &component) in messages.iter().enumerate() {
            let (lane, row) = (index / n_components, index % n_components);
            rows[row * S::F32_LANES + lane] = component.clamp(0.0, 1.0) as f32;
        }
        for (lane, &u) in u.iter().enumerate() {
            rows[n_components * S::F32_LANES + lane] = middle(u);
        }
        let rows = S::as_simd_f32s(rows).0;
        let (components, u) = (&rows[..n_components], rows[n_components]);
        let weights = S::as_mut_simd_f32s(weights).0;

        let mut nearest = simd.splat_f32s(f32::MAX);
        for (weight, point) in weights.iter_mut().zip(quantiser.points.chunks_exact(n_components)) {
            let mut squares = simd.splat_f32s(0.0);
            for (component, &level) in components.iter().zip(point) {
                let difference = simd.sub_f32s(simd.splat_f32s(level as f32), *component);
                squares = simd.mul_add_f32s(difference, difference, squares);
            }
            *weight = simd.sqrt_f32s(squares);
            nearest = simd.min_f32s(nearest, *weight);
        }
        let slope = simd.splat_f32s(quantiser.slope);
        let mut total = simd.splat_f32s(0.0);
        for weight in &mut *weights {
            *weight = exp2(simd, simd.mul_f32s(slope, simd.sub_f32s(*weight, nearest)));
            total = simd.add_f32s(total, *weight);
        }
        // The symbol is the number of points with a cumulative weight of at most u.
        let target = simd.mul_f32s(u, total);
        let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
        let (mut sum, mut n_passed) = (zero, zero);
        for weight in &*weights {
            sum = simd.add_f32s(sum, *weight);
            let is_passed = simd.less_than_or_equal_f32s(sum, target);
            n_passed = simd.add_f32s(n_passed, simd.select_f32s(is_passed, one, zero));
        }
        weights[0] = n_passed;
        let symbols = &memory[(n_components + 1) * S::F32_LANES..];
        for (message, &symbol) in messages.chunks_exact_mut(n_components).zip(symbols) {
            // Because of rounding, the count may include all points.
            let symbol = (symbol as usize).min(n_points - 1);
            let point = &quantiser.points[symbol * n_components..][..n_components];
            message.copy_from_slice(point);
        }
    }
}

/// The middle of the interval of width 2^-23 that contains a number in \[0, 1): exact in f32,
/// below 1, and larger than the weights of distant points.
fn middle(u: f64) -> f32 {
    const N_INTERVALS: f64 = (1 << 23) as f64;
    (((u * N_INTERVALS).floor() + 0.5) / N_INTERVALS) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantised(quantiser: &Quantiser, message: [f64; 2], u: f64) -> [f64; 2] {
        let mut message = message;
        quantiser.quantise(Isa::best(), &mut message, &[u], &mut Scratch::default());
        message
    }

    #[test]
    fn four_levels_of_two_components_make_sixteen_symbols() {
        let quantiser = Quantiser::new(2, 4, 100.0);
        assert_eq!(quantiser.points.len(), 32);
        assert_eq!(quantiser.points[..4], [0.0, 0.0, 0.0, 1.0 / 3.0]);
        assert_eq!(quantiser.points[8..10], [1.0 / 3.0, 0.0]);
        assert_eq!(quantiser.points[30..], [1.0, 1.0]);
    }

    #[test]
    fn a_cold_quantiser_takes_the_nearest_point() {
        let quantiser = Quantiser::new(2, 4, 1e4);
        for u in [0.0, 0.5, 0.999_999] {
            assert_eq!(quantised(&quantiser, [0.3, 0.95], u), [1.0 / 3.0, 1.0]);
            assert_eq!(quantised(&quantiser, [-7.0, 7.0], u), [0.0, 1.0]);
        }
    }

    #[test]
    fn a_hot_quantiser_is_uniform() {
        let quantiser = Quantiser::new(2, 4, 0.0);
        assert_eq!(quantised(&quantiser, [0.9, 0.9], 0.0), [0.0, 0.0]);
        assert_eq!(quantised(&quantiser, [0.9, 0.9], 1.5 / 16.0), [0.0, 1.0 / 3.0]);
        assert_eq!(quantised(&quantiser, [0.1, 0.1], 15.5 / 16.0), [1.0, 1.0]);
    }

    #[test]
    fn probabilities_match_a_case_by_hand() {
        // Two points, at distances 0.25 and 0.75 from a message of one component.
        let quantiser = Quantiser::new(1, 2, 2.0);
        let p_near = 1.0 / (1.0 + libm::exp(-1.0));
        for (u, level) in [(p_near - 1e-6, 0.0), (p_near + 1e-6, 1.0)] {
            let mut message = [0.25];
            quantiser.quantise(Isa::best(), &mut message, &[u], &mut Scratch::default());
            assert_eq!(message, [level]);
        }
    }
}

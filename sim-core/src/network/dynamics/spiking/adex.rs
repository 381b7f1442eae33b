//! Adaptive exponential integrate and fire (Brette and Gerstner 2005) as SpikeSwarmSim has it: v +=
//! dt / tau_m (V_rest - v + 2 exp((v - theta) / 2) - w + I), at most 30 mV; at 30 mV a spike, s =
//! 1, then v = V_reset; w += dt / tau_w (A (v - V_rest) - w + B tau_w s); theta += dt ((1 - s)
//! (theta_rest - theta) / 50 + 20 s).

use determinism::simd::Simd;

use super::functions::exp;
use super::model::{FLOOR, Model, Parameters};

/// Voltage of a spike, mV.
const PEAK: f32 = 30.0;
/// Time constant of the threshold, ms.
const TAU_THETA: f64 = 50.0;
/// Rise of the threshold by a spike, mV per ms of the step.
const THETA_RISE: f64 = 20.0;

#[derive(Debug)]
pub(super) struct AdEx;

/// v, w, theta
impl Model<9, 3> for AdEx {
    fn constants(p: Parameters<'_>, dt: f64) -> [f64; 9] {
        [
            dt / p("tau_m"),
            p("V_rest"),
            dt / p("tau_w"),
            p("A"),
            dt * p("B"),
            dt / TAU_THETA,
            p("theta_rest"),
            dt * THETA_RISE,
            p("V_reset"),
        ]
    }

    fn start(p: Parameters<'_>) -> [f64; 3] {
        [p("V_rest"), 0.0, p("theta_rest")]
    }

    #[inline(always)]
    fn update<S: Simd>(
        simd: S,
        [rate, rest, rate_w, a, jump_w, rate_theta, rest_theta, jump_theta, reset]: [S::f32s; 9],
        [v, w, theta]: [S::f32s; 3],
        current: S::f32s,
    ) -> ([S::f32s; 3], S::m32s) {
        let above = simd.sub_f32s(v, theta);
        let upswing = exp(simd, simd.mul_f32s(above, simd.splat_f32s(0.5)));
        let slope = simd.mul_add_f32s(simd.splat_f32s(2.0), upswing, simd.sub_f32s(rest, v));
        let slope = simd.add_f32s(simd.sub_f32s(slope, w), current);
        let next = simd.mul_add_f32s(rate, slope, v);
        let next = simd.max_f32s(next, simd.splat_f32s(FLOOR));
        let spiked = simd.greater_than_or_equal_f32s(next, simd.splat_f32s(PEAK));
        let slope_w = simd.mul_add_f32s(a, simd.sub_f32s(v, rest), simd.neg_f32s(w));
        let w = simd.mul_add_f32s(rate_w, slope_w, w);
        let w = simd.select_f32s(spiked, simd.add_f32s(w, jump_w), w);
        let relaxed = simd.mul_add_f32s(rate_theta, simd.sub_f32s(rest_theta, theta), theta);
        let theta = simd.select_f32s(spiked, simd.add_f32s(theta, jump_theta), relaxed);
        ([simd.select_f32s(spiked, reset, next), w, theta], spiked)
    }
}

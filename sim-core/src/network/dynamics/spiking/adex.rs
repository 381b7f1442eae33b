//! Adaptive exponential integrate and fire (Brette and Gerstner 2005) as SpikeSwarmSim has it: v +=
//! dt / tau_m (V_rest - v + 2 exp((v - theta) / 2) - w + I), at most 30 mV; at 30 mV a spike, s =
//! 1, then v = V_reset; w += dt / tau_w (A (v - V_rest) - w + B tau_w s); theta += dt ((1 - s)
//! (theta_rest - theta) / 50 + 20 s).

use determinism::simd::Simd;

use super::functions::exp;
use super::model::{FLOOR, Model, Parameters};
use super::row::{Mask, Row};

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
    fn update<S: Simd, const W: usize>(
        [rate, rest, rate_w, a, jump_w, rate_theta, rest_theta, jump_theta, reset]: [Row<S, W>; 9],
        [v, w, theta]: [Row<S, W>; 3],
        current: Row<S, W>,
    ) -> ([Row<S, W>; 3], Mask<S, W>) {
        let upswing = exp((v - theta) * v.constant(0.5));
        let slope = v.constant(2.0).mul_add(upswing, rest - v) - w + current;
        let next = rate.mul_add(slope, v).at_least(FLOOR);
        let spiked = next.reaches(v.constant(PEAK));
        let w = rate_w.mul_add(a.mul_add(v - rest, -w), w);
        let w = spiked.select(w + jump_w, w);
        let relaxed = rate_theta.mul_add(rest_theta - theta, theta);
        let theta = spiked.select(theta + jump_theta, relaxed);
        ([spiked.select(reset, next), w, theta], spiked)
    }
}

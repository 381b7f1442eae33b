//! Morris and Lecar 1981: m = (1 + tanh((v - V1) / V2)) / 2,
//! n_inf = (1 + tanh((v - V3) / V4)) / 2, 1 / tau_n = cosh((v - V3) / (2 V4));
//! v += dt / Cm (I - g_L (v - E_L) - g_K n (v - E_K) - g_Ca m (v - E_Ca)), within
//! [-85, 40]; n += dt phi (n_inf - n) / tau_n, at most all the way to n_inf; a spike in
//! every substep that ends at 35.5 mV or more.

use determinism::simd::Simd;

use super::functions::{cosh, tanh};
use super::model::{Model, Parameters};

/// Lowest voltage, mV.
const LOWEST: f32 = -85.0;
/// Highest voltage, mV.
const HIGHEST: f32 = 40.0;
/// Voltage from which on a neuron spikes, mV.
const SPIKE: f32 = 35.5;
/// Voltage at the start, mV.
const START: f64 = -50.0;

#[derive(Debug)]
pub(super) struct MorrisLecar;

/// v, n
impl Model<12, 2> for MorrisLecar {
    fn constants(p: Parameters<'_>, dt: f64) -> [f64; 12] {
        [
            dt / p("Cm"),
            p("g_L"),
            p("E_L"),
            p("g_K"),
            p("E_K"),
            p("g_Ca"),
            p("E_Ca"),
            p("V1"),
            1.0 / p("V2"),
            p("V3"),
            1.0 / p("V4"),
            dt * p("phi"),
        ]
    }

    fn start(p: Parameters<'_>) -> [f64; 2] {
        [START, 0.5 * (1.0 + libm::tanh((START - p("V3")) / p("V4")))]
    }

    #[inline(always)]
    fn update<S: Simd>(
        simd: S,
        [rate, g_l, e_l, g_k, e_k, g_ca, e_ca, v1, per_v2, v3, per_v4, rate_n]: [S::f32s; 12],
        [v, n]: [S::f32s; 2],
        current: S::f32s,
    ) -> ([S::f32s; 2], S::m32s) {
        let (half, one) = (simd.splat_f32s(0.5), simd.splat_f32s(1.0));
        let m = tanh(simd, simd.mul_f32s(simd.sub_f32s(v, v1), per_v2));
        let m = simd.mul_add_f32s(half, m, half);
        let x = simd.mul_f32s(simd.sub_f32s(v, v3), per_v4);
        let n_inf = simd.mul_add_f32s(half, tanh(simd, x), half);
        let share = simd.mul_f32s(rate_n, cosh(simd, simd.mul_f32s(half, x)));
        let share = simd.min_f32s(share, one);

        let leak = simd.mul_f32s(g_l, simd.sub_f32s(v, e_l));
        let potassium = simd.mul_f32s(simd.mul_f32s(g_k, n), simd.sub_f32s(v, e_k));
        let calcium = simd.mul_f32s(simd.mul_f32s(g_ca, m), simd.sub_f32s(v, e_ca));
        let out = simd.add_f32s(simd.add_f32s(leak, potassium), calcium);
        let next = simd.mul_add_f32s(rate, simd.sub_f32s(current, out), v);
        let next = simd.max_f32s(next, simd.splat_f32s(LOWEST));
        let next = simd.min_f32s(next, simd.splat_f32s(HIGHEST));
        let n = simd.mul_add_f32s(share, simd.sub_f32s(n_inf, n), n);
        ([next, n], simd.greater_than_or_equal_f32s(next, simd.splat_f32s(SPIKE)))
    }
}

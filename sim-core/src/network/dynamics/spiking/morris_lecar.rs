//! Morris and Lecar 1981: m = (1 + tanh((v - V1) / V2)) / 2,
//! n_inf = (1 + tanh((v - V3) / V4)) / 2, 1 / tau_n = cosh((v - V3) / (2 V4));
//! v += dt / Cm (I - g_L (v - E_L) - g_K n (v - E_K) - g_Ca m (v - E_Ca)), within
//! [-85, 40]; n += dt phi (n_inf - n) / tau_n, at most all the way to n_inf; a spike in
//! every substep that ends at 35.5 mV or more.

use determinism::simd::Simd;

use super::functions::{cosh, tanh};
use super::model::{Model, Parameters};
use super::row::{Mask, Row};

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
    fn update<S: Simd, const W: usize>(
        [rate, g_l, e_l, g_k, e_k, g_ca, e_ca, v1, per_v2, v3, per_v4, rate_n]: [Row<S, W>; 12],
        [v, n]: [Row<S, W>; 2],
        current: Row<S, W>,
    ) -> ([Row<S, W>; 2], Mask<S, W>) {
        let half = v.constant(0.5);
        let m = half.mul_add(tanh((v - v1) * per_v2), half);
        let x = (v - v3) * per_v4;
        let n_inf = half.mul_add(tanh(x), half);
        let share = (rate_n * cosh(half * x)).at_most(1.0);

        let leak = g_l * (v - e_l);
        let potassium = g_k * n * (v - e_k);
        let calcium = g_ca * m * (v - e_ca);
        let out = leak + potassium + calcium;
        let next = rate.mul_add(current - out, v).at_least(LOWEST).at_most(HIGHEST);
        let n = share.mul_add(n_inf - n, n);
        ([next, n], next.reaches(v.constant(SPIKE)))
    }
}

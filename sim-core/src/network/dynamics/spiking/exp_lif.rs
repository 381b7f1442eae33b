//! Exponential integrate and fire (Fourcaud-Trocme et al. 2003) as SpikeSwarmSim has it: v += dt /
//! tau (v_rest - v + 0.3 exp(v - thresh) + 0.6 I), at most 30 mV; at 30 mV a spike, then v =
//! v_rest, and I = 0 for `time_refrac` substeps.

use determinism::simd::Simd;

use super::functions::exp;
use super::lif::gate;
use super::model::{FLOOR, Model, Parameters};

/// Voltage of a spike, mV.
const PEAK: f32 = 30.0;

#[derive(Debug)]
pub(super) struct ExpLif;

/// State: v, and the remaining refractory substeps.
impl Model<4, 2> for ExpLif {
    fn constants(p: Parameters<'_>, dt: f64) -> [f64; 4] {
        [dt / p("tau"), p("v_rest"), p("thresh"), p("time_refrac")]
    }

    fn start(p: Parameters<'_>) -> [f64; 2] {
        [p("v_rest"), 0.0]
    }

    #[inline(always)]
    fn update<S: Simd>(
        simd: S,
        [rate, rest, threshold, refractory]: [S::f32s; 4],
        [v, waiting]: [S::f32s; 2],
        current: S::f32s,
    ) -> ([S::f32s; 2], S::m32s) {
        let (current, waiting) = gate(simd, waiting, current);
        let upswing = exp(simd, simd.sub_f32s(v, threshold));
        let slope = simd.mul_add_f32s(simd.splat_f32s(0.3), upswing, simd.sub_f32s(rest, v));
        let slope = simd.mul_add_f32s(simd.splat_f32s(0.6), current, slope);
        let v = simd.mul_add_f32s(rate, slope, v);
        let v = simd.max_f32s(v, simd.splat_f32s(FLOOR));
        let spiked = simd.greater_than_or_equal_f32s(v, simd.splat_f32s(PEAK));
        let v = simd.select_f32s(spiked, rest, v);
        ([v, simd.select_f32s(spiked, refractory, waiting)], spiked)
    }
}

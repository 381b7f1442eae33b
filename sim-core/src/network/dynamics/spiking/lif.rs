//! Leaky integrate and fire: v += dt / tau (v_rest - v + R I), I = 0 for `time_refrac`
//! substeps after a spike; a spike where v >= thresh, then v = v_rest.

use determinism::simd::Simd;

use super::model::{FLOOR, Model, Parameters};

#[derive(Debug)]
pub(super) struct Lif;

/// State: v, and the remaining refractory substeps.
impl Model<5, 2> for Lif {
    fn constants(p: Parameters<'_>, dt: f64) -> [f64; 5] {
        [dt / p("tau"), p("v_rest"), p("R"), p("thresh"), p("time_refrac")]
    }

    fn start(p: Parameters<'_>) -> [f64; 2] {
        [p("v_rest"), 0.0]
    }

    #[inline(always)]
    fn update<S: Simd>(
        simd: S,
        [rate, rest, resistance, threshold, refractory]: [S::f32s; 5],
        [v, waiting]: [S::f32s; 2],
        current: S::f32s,
    ) -> ([S::f32s; 2], S::m32s) {
        let (current, waiting) = gate(simd, waiting, current);
        let slope = simd.mul_add_f32s(resistance, current, simd.sub_f32s(rest, v));
        let v = simd.mul_add_f32s(rate, slope, v);
        let v = simd.max_f32s(v, simd.splat_f32s(FLOOR));
        let spiked = simd.greater_than_or_equal_f32s(v, threshold);
        let v = simd.select_f32s(spiked, rest, v);
        ([v, simd.select_f32s(spiked, refractory, waiting)], spiked)
    }
}

/// The effective current of a neuron, and its refractory substeps after this substep.
#[inline(always)]
pub(super) fn gate<S: Simd>(simd: S, waiting: S::f32s, current: S::f32s) -> (S::f32s, S::f32s) {
    let zero = simd.splat_f32s(0.0);
    let is_refractory = simd.greater_than_f32s(waiting, zero);
    let left = simd.max_f32s(simd.sub_f32s(waiting, simd.splat_f32s(1.0)), zero);
    (simd.select_f32s(is_refractory, zero, current), left)
}

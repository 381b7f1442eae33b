//! Izhikevich 2003: neurons that spiked before have u += D, v = C; then
//! v += dt (0.04 v^2 + 5 v + 140 - u + 0.1 I), within [-85, 30], and
//! u += dt A (B v - u); a spike at 30 mV.

use determinism::simd::Simd;

use super::model::{Model, Parameters};

/// Voltage of a spike, mV.
const PEAK: f32 = 30.0;
/// Lowest voltage, mV.
const LOWEST: f32 = -85.0;

#[derive(Debug)]
pub(super) struct Izhikevich;

/// v, u
impl Model<5, 2> for Izhikevich {
    fn constants(p: Parameters<'_>, dt: f64) -> [f64; 5] {
        [dt, dt * p("A"), p("B"), p("C"), p("D")]
    }

    fn start(p: Parameters<'_>) -> [f64; 2] {
        [p("C"), p("B") * p("C")]
    }

    #[inline(always)]
    fn update<S: Simd>(
        simd: S,
        [dt, rate_u, b, c, d]: [S::f32s; 5],
        [v, u]: [S::f32s; 2],
        current: S::f32s,
    ) -> ([S::f32s; 2], S::m32s) {
        let peak = simd.splat_f32s(PEAK);
        let spiked_before = simd.greater_than_or_equal_f32s(v, peak);
        let u = simd.select_f32s(spiked_before, simd.add_f32s(u, d), u);
        let v = simd.select_f32s(spiked_before, c, v);
        let quadratic = simd.mul_add_f32s(simd.splat_f32s(0.04), v, simd.splat_f32s(5.0));
        let slope = simd.mul_add_f32s(quadratic, v, simd.sub_f32s(simd.splat_f32s(140.0), u));
        let slope = simd.mul_add_f32s(simd.splat_f32s(0.1), current, slope);
        let next = simd.min_f32s(simd.mul_add_f32s(dt, slope, v), peak);
        let next = simd.max_f32s(next, simd.splat_f32s(LOWEST));
        let slope_u = simd.mul_add_f32s(b, v, simd.neg_f32s(u));
        let u = simd.mul_add_f32s(rate_u, slope_u, u);
        ([next, u], simd.greater_than_or_equal_f32s(next, peak))
    }
}

//! Izhikevich 2003: neurons that spiked before have u += D, v = C; then
//! v += dt (0.04 v^2 + 5 v + 140 - u + 0.1 I), within [-85, 30], and
//! u += dt A (B v - u); a spike at 30 mV.

use determinism::simd::Simd;

use super::model::{Model, Parameters};
use super::row::{Mask, Row};

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
    fn update<S: Simd, const W: usize>(
        [dt, rate_u, b, c, d]: [Row<S, W>; 5],
        [v, u]: [Row<S, W>; 2],
        current: Row<S, W>,
    ) -> ([Row<S, W>; 2], Mask<S, W>) {
        let peak = v.constant(PEAK);
        let spiked_before = v.reaches(peak);
        let u = spiked_before.select(u + d, u);
        let v = spiked_before.select(c, v);
        let quadratic = v.constant(0.04).mul_add(v, v.constant(5.0));
        let slope = quadratic.mul_add(v, v.constant(140.0) - u);
        let slope = v.constant(0.1).mul_add(current, slope);
        let next = dt.mul_add(slope, v).at_most(PEAK).at_least(LOWEST);
        let u = rate_u.mul_add(b.mul_add(v, -u), u);
        ([next, u], next.reaches(peak))
    }
}

//! Exponential integrate and fire (Fourcaud-Trocme et al. 2003) as SpikeSwarmSim has it: v += dt /
//! tau (v_rest - v + 0.3 exp(v - thresh) + 0.6 I), at most 30 mV; at 30 mV a spike, then v =
//! v_rest, and I = 0 for `time_refrac` substeps.

use determinism::simd::Simd;

use super::functions::exp;
use super::lif::gate;
use super::model::{FLOOR, Model, Parameters};
use super::row::{Mask, Row};

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
    fn update<S: Simd, const W: usize>(
        [rate, rest, threshold, refractory]: [Row<S, W>; 4],
        [v, waiting]: [Row<S, W>; 2],
        current: Row<S, W>,
    ) -> ([Row<S, W>; 2], Mask<S, W>) {
        let (current, waiting) = gate(waiting, current);
        let upswing = exp(v - threshold);
        let slope = v.constant(0.3).mul_add(upswing, rest - v);
        let slope = v.constant(0.6).mul_add(current, slope);
        let v = rate.mul_add(slope, v).at_least(FLOOR);
        let spiked = v.reaches(v.constant(PEAK));
        ([spiked.select(rest, v), spiked.select(refractory, waiting)], spiked)
    }
}

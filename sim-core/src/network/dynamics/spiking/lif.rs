//! Leaky integrate and fire: v += dt / tau (v_rest - v + R I), I = 0 for `time_refrac`
//! substeps after a spike; a spike where v >= thresh, then v = v_rest.

use determinism::simd::Simd;

use super::model::{FLOOR, Model, Parameters};
use super::row::{Mask, Row};

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
    fn update<S: Simd, const W: usize>(
        [rate, rest, resistance, threshold, refractory]: [Row<S, W>; 5],
        [v, waiting]: [Row<S, W>; 2],
        current: Row<S, W>,
    ) -> ([Row<S, W>; 2], Mask<S, W>) {
        let (current, waiting) = gate(waiting, current);
        let slope = resistance.mul_add(current, rest - v);
        let v = rate.mul_add(slope, v).at_least(FLOOR);
        let spiked = v.reaches(threshold);
        ([spiked.select(rest, v), spiked.select(refractory, waiting)], spiked)
    }
}

/// The effective current of a neuron, and its refractory substeps after this substep.
#[inline(always)]
pub(super) fn gate<S: Simd, const W: usize>(
    waiting: Row<S, W>,
    current: Row<S, W>,
) -> (Row<S, W>, Row<S, W>) {
    let (zero, one) = (waiting.constant(0.0), waiting.constant(1.0));
    (waiting.exceeds(zero).select(zero, current), (waiting - one).at_least(0.0))
}

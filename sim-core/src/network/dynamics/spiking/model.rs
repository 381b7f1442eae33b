//! The interface of models of spiking neurons: one substep of one neuron in W vectors of lanes.

use std::fmt;

use determinism::simd::Simd;

use super::row::{Mask, Row};

/// The parameters of one neuron, by name.
pub(super) type Parameters<'a> = &'a dyn Fn(&str) -> f64;

/// Lower bound of all voltages, mV: it keeps numbers finite, and is far below the voltages of any
/// neuron.
pub(super) const FLOOR: f32 = -1e6;

/// A model with C constants and Z state variables per neuron; the first variable is the voltage
/// v, mV.
pub(super) trait Model<const C: usize, const Z: usize>: fmt::Debug {
    /// The constants of a neuron. `dt`: ms.
    fn constants(parameters: Parameters<'_>, dt: f64) -> [f64; C];

    /// The state before the first substep: v at rest, the others at their fixed point.
    fn start(parameters: Parameters<'_>) -> [f64; Z];

    /// One explicit Euler step with a synaptic current. Returns the new state, and the lanes with
    /// a spike.
    ///
    /// Spikes are monotone in the current, and so is the new voltage where spikes are the same. Other
    /// variables depend on the current by the spike alone. So if two currents have the same result,
    /// all currents between them have it, too.
    fn update<S: Simd, const W: usize>(
        constants: [Row<S, W>; C],
        state: [Row<S, W>; Z],
        current: Row<S, W>,
    ) -> ([Row<S, W>; Z], Mask<S, W>);
}

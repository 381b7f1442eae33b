//! Morris and Lecar 1981, with currents of a leak, of potassium and of calcium. A spike in
//! every substep that ends at 35.5 mV or more.

use super::{NeuronModelSpec, NeuronParameter, TIME, VOLTAGE};
use std::ops::RangeInclusive;

/// Conductances, mS/cm2.
const CONDUCTANCE: RangeInclusive<f64> = 0.0..=1_000.0;
/// Widths of activation curves, mV.
const WIDTH: RangeInclusive<f64> = 1.0..=200.0;

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["morris_lecar"],
    is_spiking: true,
    parameters: &[
        NeuronParameter::linear(
            "phi",
            "1/ms",
            0.067,
            0.0..=2.0,
            "Rate of the potassium channels, 1/ms; default 0.067.",
        ),
        NeuronParameter::linear(
            "g_Ca",
            "mS/cm2",
            4.0,
            CONDUCTANCE,
            "Conductance of calcium, mS/cm2; default 4.",
        ),
        NeuronParameter::linear(
            "g_K",
            "mS/cm2",
            8.0,
            CONDUCTANCE,
            "Conductance of potassium, mS/cm2; default 8.",
        ),
        NeuronParameter::linear(
            "g_L",
            "mS/cm2",
            2.0,
            CONDUCTANCE,
            "Conductance of the leak, mS/cm2; default 2.",
        ),
        NeuronParameter::linear(
            "V1",
            "mV",
            -1.2,
            VOLTAGE,
            "Voltage at which half of the calcium channels are open, mV; default -1.2.",
        ),
        NeuronParameter::linear("V2", "mV", 18.0, WIDTH, "Width of that curve, mV; default 18."),
        NeuronParameter::linear(
            "V3",
            "mV",
            12.0,
            VOLTAGE,
            "Voltage at which half of the potassium channels are open, mV; default 12.",
        ),
        NeuronParameter::linear("V4", "mV", 17.4, WIDTH, "Width of that curve, mV; default 17.4."),
        NeuronParameter::linear(
            "E_Ca",
            "mV",
            120.0,
            VOLTAGE,
            "Reversal potential of calcium, mV; default 120.",
        ),
        NeuronParameter::linear(
            "E_K",
            "mV",
            -84.0,
            VOLTAGE,
            "Reversal potential of potassium, mV; default -84.",
        ),
        NeuronParameter::linear(
            "E_L",
            "mV",
            -60.0,
            VOLTAGE,
            "Reversal potential of the leak, mV; default -60.",
        ),
        NeuronParameter::linear("Cm", "uF/cm2", 20.0, TIME, "Capacitance, uF/cm2; default 20."),
    ],
    activation: None,
    states_per_neuron: 8,
    operations_per_neuron: 60,
};

//! Morris and Lecar 1981, with currents of a leak, of potassium and of calcium. The neuron spikes
//! in every substep that ends at 35.5 mV or more.

use super::{NeuronModelSpec, NeuronParameter, TIME, VOLTAGE};

/// Conductances, mS/cm2.
const CONDUCTANCE: [f64; 2] = [0.0, 1_000.0];
/// Widths of activation curves, mV.
const WIDTH: [f64; 2] = [1.0, 200.0];

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["morris_lecar"],
    is_spiking: true,
    parameters: &[
        NeuronParameter::linear("phi", "1/ms", 0.067, [0.0, 2.0], "Rate of the potassium channels"),
        NeuronParameter::linear("g_Ca", "mS/cm2", 4.0, CONDUCTANCE, "Conductance of calcium"),
        NeuronParameter::linear("g_K", "mS/cm2", 8.0, CONDUCTANCE, "Conductance of potassium"),
        NeuronParameter::linear("g_L", "mS/cm2", 2.0, CONDUCTANCE, "Conductance of the leak"),
        NeuronParameter::linear(
            "V1",
            "mV",
            -1.2,
            VOLTAGE,
            "Voltage at which half of the calcium channels are open",
        ),
        NeuronParameter::linear("V2", "mV", 18.0, WIDTH, "Width of the curve around `V1`"),
        NeuronParameter::linear(
            "V3",
            "mV",
            12.0,
            VOLTAGE,
            "Voltage at which half of the potassium channels are open",
        ),
        NeuronParameter::linear("V4", "mV", 17.4, WIDTH, "Width of the curve around `V3`"),
        NeuronParameter::linear("E_Ca", "mV", 120.0, VOLTAGE, "Reversal potential of calcium"),
        NeuronParameter::linear("E_K", "mV", -84.0, VOLTAGE, "Reversal potential of potassium"),
        NeuronParameter::linear("E_L", "mV", -60.0, VOLTAGE, "Reversal potential of the leak"),
        NeuronParameter::linear("Cm", "uF/cm2", 20.0, TIME, "Capacitance"),
    ],
    activation: None,
    states_per_neuron: 8,
    operations_per_neuron: 60,
};

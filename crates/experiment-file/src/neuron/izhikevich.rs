//! Izhikevich 2003: dv/dt = 0.04 v^2 + 5 v + 140 - u + 0.1 I, du/dt = A (B v - u), a
//! spike at 30 mV, after which v = C and u rises by D.

use super::{NeuronModelSpec, NeuronParameter};

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["izhikevich"],
    is_spiking: true,
    parameters: &[
        NeuronParameter::linear("A", "1/ms", 0.02, [0.0, 1.0], "Rate of the recovery u"),
        NeuronParameter::linear("B", "", 0.2, [-10.0, 10.0], "Recovery per mV"),
        NeuronParameter::linear("C", "mV", -65.0, [-85.0, 29.0], "Voltage after a spike"),
        NeuronParameter::linear(
            "D",
            "",
            8.0,
            [-100.0, 100.0],
            "Increase of the recovery by a spike",
        ),
    ],
    activation: None,
    states_per_neuron: 8,
    operations_per_neuron: 12,
};

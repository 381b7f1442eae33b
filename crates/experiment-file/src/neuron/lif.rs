//! Leaky integrate and fire: tau dv/dt = v_rest - v + R I, a spike where v reaches thresh, after
//! which v is v_rest. For `time_refrac` substeps after a spike, the neuron takes no current.

use super::{NeuronModelSpec, NeuronParameter, VOLTAGE};

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["lif"],
    is_spiking: true,
    parameters: &[
        NeuronParameter::time_constant("tau", 20.0, "Membrane time constant"),
        NeuronParameter::linear(
            "v_rest",
            "mV",
            -65.0,
            VOLTAGE,
            "Resting voltage, to which spikes reset",
        ),
        NeuronParameter::linear("thresh", "mV", -50.0, VOLTAGE, "Threshold"),
        NeuronParameter::refractory_substeps(5),
        NeuronParameter::linear("R", "", 1.0, [0.0, 1_000.0], "Factor of the current"),
    ],
    activation: None,
    states_per_neuron: 8,
    operations_per_neuron: 8,
};

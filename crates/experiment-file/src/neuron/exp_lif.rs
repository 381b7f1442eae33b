//! Exponential integrate and fire (Fourcaud-Trocme et al. 2003), as SpikeSwarmSim has it:
//! tau dv/dt = v_rest - v + 0.3 exp(v - thresh) + 0.6 I, a spike at 30 mV.

use super::{NeuronModelSpec, NeuronParameter, VOLTAGE};

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["exp_lif"],
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
        NeuronParameter::linear(
            "thresh",
            "mV",
            -40.0,
            VOLTAGE,
            "Voltage at which the upswing of a spike begins",
        ),
        NeuronParameter::refractory_substeps(10),
    ],
    activation: None,
    states_per_neuron: 8,
    operations_per_neuron: 20,
};

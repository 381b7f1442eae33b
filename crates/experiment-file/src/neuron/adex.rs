//! Adaptive exponential integrate and fire (Brette and Gerstner 2005), with a threshold
//! theta that spikes raise: tau_m dv/dt = V_rest - v + 2 exp((v - theta) / 2) - w + I,
//! tau_w dw/dt = A (v - V_rest) - w, a spike at 30 mV.

use super::{NeuronModelSpec, NeuronParameter, VOLTAGE};

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["adex"],
    is_spiking: true,
    parameters: &[
        NeuronParameter::time_constant("tau_m", 10.0, "Membrane time constant"),
        NeuronParameter::time_constant("tau_w", 70.0, "Time constant of the adaptation w"),
        NeuronParameter::linear("V_rest", "mV", -70.0, VOLTAGE, "Resting voltage"),
        NeuronParameter::linear("V_reset", "mV", -55.0, [-200.0, 29.0], "Voltage after a spike"),
        NeuronParameter::linear("A", "", 0.0, [-10.0, 100.0], "Adaptation per mV above rest"),
        NeuronParameter::linear(
            "B",
            "",
            5.0,
            [-1_000.0, 1_000.0],
            "Increase of w by a spike, per ms of the step",
        ),
        NeuronParameter::linear("theta_rest", "mV", -45.0, VOLTAGE, "Threshold long after a spike"),
    ],
    activation: None,
    states_per_neuron: 10,
    operations_per_neuron: 30,
};

//! Rate neurons (sections 2.1 and 3.4 of the thesis):
//! tau dv/dt = -v + input, activity F(g * (v + beta)).

use super::{GeneScale, NeuronModelSpec, NeuronParameter};
use crate::Activation;
use crate::limits::MAGNITUDE;

const POSITIVE: [f64; 2] = [1.0 / MAGNITUDE, MAGNITUDE];
const QUANTITY: [f64; 2] = [-MAGNITUDE, MAGNITUDE];
const TAU: &str = "Time constant. A gene is an exponent x: tau = 2 * 10^x.";

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["rate_model", "ctrnn"],
    is_spiking: false,
    parameters: &[
        NeuronParameter {
            gene: Some(GeneScale::PowerOfTen { factor: 2.0 }),
            is_time_constant: true,
            ..NeuronParameter::linear("tau", "s", 2.0, POSITIVE, TAU)
        },
        // As in section 4.3.
        NeuronParameter {
            aliases: &["gains"],
            ..NeuronParameter::linear("gain", "", 1.0, QUANTITY, "Gain g")
        },
        NeuronParameter::linear("bias", "", 0.0, QUANTITY, "Bias beta"),
    ],
    activation: Some(Activation::Sigmoid),
    states_per_neuron: 1,
    operations_per_neuron: 1,
};

//! Rate neurons (sections 2.1 and 3.4 of the thesis):
//! tau dv/dt = -v + input, activity F(g * (v + beta)).

use super::{GeneScale, NeuronModelSpec, NeuronParameter};
use crate::Activation;
use crate::limits::{POSITIVE, QUANTITY};

pub(super) static SPEC: NeuronModelSpec = NeuronModelSpec {
    names: &["rate_model", "ctrnn"],
    is_spiking: false,
    parameters: &[
        NeuronParameter {
            name: "tau",
            aliases: &[],
            description: "Time constant, seconds; default 2, which is 2 * 10^0 on the scale of \
                          Table 3.3. A gene is an exponent x: tau = 2 * 10^x.",
            unit: "s",
            default: 2.0,
            range: POSITIVE,
            gene: Some(GeneScale::PowerOfTen { factor: 2.0 }),
            is_time_constant: true,
            is_whole: false,
        },
        NeuronParameter {
            name: "gain",
            // As in section 4.3.
            aliases: &["gains"],
            description: "Gain g; default 1.",
            unit: "",
            default: 1.0,
            range: QUANTITY,
            gene: Some(GeneScale::Linear),
            is_time_constant: false,
            is_whole: false,
        },
        NeuronParameter {
            name: "bias",
            aliases: &[],
            description: "Bias beta; default 0.",
            unit: "",
            default: 0.0,
            range: QUANTITY,
            gene: Some(GeneScale::Linear),
            is_time_constant: false,
            is_whole: false,
        },
    ],
    activation: Some(Activation::Sigmoid),
    states_per_neuron: 1,
    operations_per_neuron: 1,
};

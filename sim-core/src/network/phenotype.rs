//! The phenotype: all values of a network's parameters.

use indexmap::IndexMap;

/// One value per synapse, one per neuron and parameter of the neuron model, and one per weight of
/// receptive fields and decodings.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Phenotype {
    /// Weights, by number of the synapse.
    pub weights: Vec<f64>,
    /// Values by number of the neuron, for each parameter of the neuron model, in its order.
    pub neurons: IndexMap<&'static str, Vec<f64>>,
    /// Delays of dynamic synapses, by number of the neuron, and then of the node of an encoder;
    /// whole substeps within [`limits::DELAYS`](experiment_file::limits::DELAYS). Empty with static
    /// synapses.
    pub delays: Vec<f64>,
    /// Weights of receptive fields, by number of the encoder, then node by node.
    pub encoders: Vec<Vec<f64>>,
    /// Coefficients of plasticity, A, B, C and D, by number of the group of synapses.
    pub learning: Vec<[f64; 4]>,
    /// Weights of decodings, by number of the output, then value by value.
    pub decoders: Vec<Vec<f64>>,
}

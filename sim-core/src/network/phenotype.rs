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
    /// By number of the neuron, and then of the node of an encoder: the delay of its dynamic
    /// synapses, whole substeps within
    /// [`limits::DELAYS`](experiment_file::limits::DELAYS). Empty with static synapses.
    pub delays: Vec<f64>,
    /// By number of the encoder: the weights of its receptive field, node by node.
    pub encoders: Vec<Vec<f64>>,
    /// By number of the group of synapses: A, B, C and D, by which its weights change if it is
    /// plastic.
    pub learning: Vec<[f64; 4]>,
    /// By number of the output: the weights of its decoding, value by value.
    pub decoders: Vec<Vec<f64>>,
}

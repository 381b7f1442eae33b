//! The values of a network that a genotype decides.

use indexmap::IndexMap;

/// One value per synapse, one per neuron and parameter of the neuron model, one per node and
/// value of the receptive fields that have weights, and one per neuron and value of such
/// decodings.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Phenotype {
    /// Weights, by number of the synapse.
    pub weights: Vec<f64>,
    /// By name of the parameter, in the order of the neuron model's parameters: its
    /// values, by number of the neuron.
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

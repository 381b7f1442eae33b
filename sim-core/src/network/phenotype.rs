//! The values of a network that a genotype decides.

use indexmap::IndexMap;

/// One value per synapse, one per neuron and parameter of the neuron model, and one per
/// neuron and value of the decodings that have weights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Phenotype {
    /// Weights, by number of the synapse.
    pub weights: Vec<f64>,
    /// By name of the parameter, in the order of the neuron model's parameters: its
    /// values, by number of the neuron.
    pub neurons: IndexMap<&'static str, Vec<f64>>,
    /// By number of the neuron: the delay of its dynamic synapses, whole substeps within
    /// [`limits::DELAYS`](experiment_file::limits::DELAYS). Empty with static synapses.
    pub delays: Vec<f64>,
    /// By number of the output: the weights of its decoding, value by value.
    pub decoders: Vec<Vec<f64>>,
}

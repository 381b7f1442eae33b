//! The values of a network that a genotype decides.

use indexmap::IndexMap;

/// One value per synapse, and one per neuron and parameter of the neuron model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Phenotype {
    /// Weights, by number of the synapse.
    pub weights: Vec<f64>,
    /// By name of the parameter, in the order of the neuron model's parameters: its
    /// values, by number of the neuron.
    pub neurons: IndexMap<&'static str, Vec<f64>>,
}

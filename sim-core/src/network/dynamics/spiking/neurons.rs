//! The neurons of a network.

use std::marker::PhantomData;

use super::model::Model;
use crate::network::{Network, Phenotype};

/// The values of a genotype for neurons of model M.
#[derive(Debug)]
pub(super) struct Neurons<M, const C: usize, const Z: usize> {
    /// Constants per neuron.
    pub constants: Vec<[f32; C]>,
    /// Start state per neuron.
    pub starts: Vec<[f32; Z]>,
    model: PhantomData<M>,
}

impl<M: Model<C, Z>, const C: usize, const Z: usize> Neurons<M, C, Z> {
    /// The neurons of a genotype.
    pub fn compile(network: &Network, phenotype: &Phenotype) -> Self {
        let n_neurons = network.n_neurons();
        let of_neuron = |neuron: usize| move |name: &str| phenotype.neurons[name][neuron];
        let constants =
            (0..n_neurons).map(|i| M::constants(&of_neuron(i), network.dt).map(|x| x as f32));
        let starts = (0..n_neurons).map(|i| M::start(&of_neuron(i)).map(|x| x as f32));
        Self { constants: constants.collect(), starts: starts.collect(), model: PhantomData }
    }
}

//! The network of a robot, with rate neurons or spiking neurons.

use determinism::random::Stream;
use experiment_file::ExperimentConfig;

use super::network::{Matrices, Network};
use super::spiking::{SpikingNetwork, SpikingState};

/// The network of a robot.
#[derive(Clone)]
pub enum Controller {
    Rate(Network),
    Spiking(SpikingNetwork),
}

impl Controller {
    /// The network that a genotype encodes.
    pub fn decode(config: &ExperimentConfig, genotype: &[f64]) -> Self {
        if config.topology.neuron_model.is_spiking() {
            Self::Spiking(SpikingNetwork::decode(config, genotype))
        } else {
            Self::Rate(Network::decode(config, genotype))
        }
    }

    /// Replaces the weights of its synapses.
    pub fn set_weights(&mut self, matrices: Matrices) {
        match self {
            Self::Rate(network) => network.set_weights(matrices),
            Self::Spiking(network) => network.set_weights(matrices),
        }
    }

    pub fn n_rate_neurons(&self) -> usize {
        match self {
            Self::Rate(network) => network.n_neurons(),
            Self::Spiking(_) => 0,
        }
    }

    pub fn rest(&self, encoding: Stream) -> SpikingState {
        match self {
            Self::Rate(_) => SpikingState::default(),
            Self::Spiking(network) => network.rest(encoding),
        }
    }
}

//! The controller that runs the network of a genotype.

use super::{Action, Controller};
use crate::lanes::Lanes;
use crate::network::decoding::Output;
use crate::network::dynamics::NetworkState;
use crate::network::{Network, Phenotype};
use determinism::Isa;
use determinism::random::Stream;

/// One network, its state in every lane, and the decoding of its outputs.
#[derive(Debug)]
pub(crate) struct NeuralController<'a> {
    state: NetworkState,
    outputs: &'a [Output],
    /// Weights of the decoder of each output.
    decoders: Vec<Vec<f64>>,
    /// Scratch of decoders.
    scratch: Vec<f64>,
}

impl<'a> NeuralController<'a> {
    /// A controller at rest in every lane. `streams`: the encoders' random streams, one per lane;
    /// empty if no encoder draws.
    pub fn new(
        isa: Isa,
        network: &'a Network,
        phenotype: &Phenotype,
        n_lanes: usize,
        streams: Vec<Stream>,
    ) -> Self {
        let state = NetworkState::new(isa, network, phenotype, n_lanes).drawing_from(streams);
        let decoders = phenotype.decoders.clone();
        Self { state, outputs: &network.outputs, decoders, scratch: Vec::new() }
    }
}

/// Largest absolute value of a reward, so that no weight overflows.
const MAX_REWARD: f64 = 1e6;

/// The reward that a network gets.
pub(crate) fn bounded(reward: f64) -> f32 {
    // A script's fitness may be NaN.
    let reward = if reward.is_nan() { 0.0 } else { reward.clamp(-MAX_REWARD, MAX_REWARD) };
    reward as f32
}

impl Controller for NeuralController<'_> {
    fn reward(&mut self, lane: usize, reward: f64) {
        self.state.reward(lane, bounded(reward));
    }

    fn perceive(&mut self, stimuli: &Lanes) {
        self.state.step(stimuli);
    }

    fn act(&mut self, lane: usize, stream: &mut Stream, action: &mut Action<'_>) {
        for (output, weights) in self.outputs.iter().zip(&self.decoders) {
            output.decode(&self.state, weights, lane, stream, &mut self.scratch, action);
        }
    }

    fn activity(&self) -> Option<Lanes> {
        Some(self.state.activity())
    }

    fn voltages(&self) -> Option<Lanes> {
        self.state.voltages()
    }
}

//! Networks of spiking neurons, by synchronous Euler steps (section 4.1 of the thesis): in every
//! substep, each neuron takes the current W s + W_I phi. s are the spikes of the previous substep.
//! phi are the stimuli, which are constant for an environment step. Stimuli with an encoder act
//! instead through the spikes of its nodes in the same substep. `docs/neurons.md` has the models.
//!
//! The state is computed in f32; constants are computed in f64 and rounded once. All lanes share
//! the weights, and never interact. The code adds up currents source by source, and skips neurons
//! that spike in no lane of a chunk: they would add zero, which changes no sum.

mod adex;
mod blueprint;
mod chunk;
mod circuit;
mod encoding;
mod exp_lif;
mod functions;
mod izhikevich;
mod lif;
mod model;
mod morris_lecar;
mod neurons;
mod receptors;
mod row;
mod subnormal;
mod wiring;

use super::{Dynamics, Inputs, SpikeWindow};
use crate::lanes::Lanes;
use crate::network::{Network, Phenotype};
pub(super) use blueprint::blueprint;
use chunk::Chunk;
use circuit::Circuit;
use determinism::Isa;
use experiment_file::NeuronModel;
use model::Model;
use neurons::Neurons;
pub(super) use wiring::Wiring;

/// A network of spiking neurons of some model, at rest.
pub(super) fn compile(
    isa: Isa,
    network: &Network,
    wiring: &Wiring,
    phenotype: &Phenotype,
    n_lanes: usize,
) -> Box<dyn Dynamics> {
    macro_rules! spiking {
        ($model:ty) => {
            Box::new(Spiking::<$model, _, _>::new(isa, network, wiring, phenotype, n_lanes))
        };
    }
    match network.model {
        NeuronModel::Rate => unreachable!("the wiring is of spiking neurons"),
        NeuronModel::Lif => spiking!(lif::Lif),
        NeuronModel::ExpLif => spiking!(exp_lif::ExpLif),
        NeuronModel::AdEx => spiking!(adex::AdEx),
        NeuronModel::Izhikevich => spiking!(izhikevich::Izhikevich),
        NeuronModel::MorrisLecar => spiking!(morris_lecar::MorrisLecar),
    }
}

/// A network with its weights, and its state in every lane.
#[derive(Debug)]
struct Spiking<M, const C: usize, const Z: usize> {
    isa: Isa,
    circuit: Circuit,
    neurons: Neurons<M, C, Z>,
    chunks: Vec<Chunk>,
}

impl<M: Model<C, Z>, const C: usize, const Z: usize> Spiking<M, C, Z> {
    fn new(
        isa: Isa,
        network: &Network,
        wiring: &Wiring,
        phenotype: &Phenotype,
        n_lanes: usize,
    ) -> Self {
        let circuit = Circuit::compile(network, wiring, phenotype);
        let neurons = Neurons::compile(network, phenotype);
        let vector_len = isa.vector_len();
        let n_vectors = n_lanes.div_ceil(vector_len);
        let max_width = chunk::max_width(isa, circuit.rule.is_some());
        let chunks = (0..n_vectors).step_by(max_width).map(|first| {
            let width = max_width.min(n_vectors - first);
            Chunk::new(&circuit, &neurons, first * vector_len, width, isa)
        });
        let chunks = chunks.collect();
        Self { isa, circuit, neurons, chunks }
    }
}

impl<M: Model<C, Z>, const C: usize, const Z: usize> Dynamics for Spiking<M, C, Z> {
    fn step(&mut self, inputs: Inputs<'_>) {
        for chunk in &mut self.chunks {
            chunk.advance(&self.circuit, &self.neurons, inputs, self.isa);
        }
    }

    /// Writes the share of substeps with a spike.
    fn write_activity(&self, neurons: &[usize], activity: &mut Lanes) {
        for chunk in &self.chunks {
            chunk.write_activity(&self.circuit, neurons, activity);
        }
    }

    fn write_window(&self, window: &mut SpikeWindow) {
        for chunk in &self.chunks {
            chunk.write_window(&self.circuit, window);
        }
    }

    fn write_voltages(&self, voltages: &mut Lanes) -> bool {
        for chunk in &self.chunks {
            chunk.write_voltages(voltages);
        }
        true
    }
}

#[cfg(test)]
mod against_brian2;
#[cfg(test)]
mod tests;

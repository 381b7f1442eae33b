//! Spiking neurons as numbers.

use super::adex::AdEx;
use super::circuit::{Circuit, Weighted};
use super::exp_lif::ExpLif;
use super::izhikevich::Izhikevich;
use super::lif::Lif;
use super::model::Model;
use super::morris_lecar::MorrisLecar;
use super::neurons::Neurons;
use super::wiring::Wiring;
use crate::blueprint::{Link, SpikingNeurons};
use crate::network::{Network, Phenotype};
use experiment_file::NeuronModel;

/// The circuit and the constants of its neurons.
pub(in super::super) fn blueprint(
    network: &Network,
    wiring: &Wiring,
    phenotype: &Phenotype,
) -> SpikingNeurons {
    let Circuit { n_neurons, encoders, afferent, outgoing, receptors, filter, .. } =
        Circuit::compile(network, wiring, phenotype);
    let [constants, starts] = match network.model {
        NeuronModel::Rate => unreachable!("the wiring is of spiking neurons"),
        NeuronModel::Lif => values::<Lif, _, _>(network, phenotype),
        NeuronModel::ExpLif => values::<ExpLif, _, _>(network, phenotype),
        NeuronModel::AdEx => values::<AdEx, _, _>(network, phenotype),
        NeuronModel::Izhikevich => values::<Izhikevich, _, _>(network, phenotype),
        NeuronModel::MorrisLecar => values::<MorrisLecar, _, _>(network, phenotype),
    };
    let motor = network.ensembles.values().filter(|ensemble| ensemble.motor);
    let n_sources = n_neurons + encoders.n_nodes();
    SpikingNeurons {
        model: network.model,
        constants,
        starts,
        afferent: links(&afferent, n_neurons),
        outgoing: links(&outgoing, n_sources),
        receptors: receptors.map(|receptors| receptors.blueprint(n_neurons)),
        lif: encoders.lif(),
        encoders: encoders.blueprint(),
        motor: motor.flat_map(|ensemble| ensemble.neurons.clone()).collect(),
        filter: [filter.retention, filter.rise, filter.decay],
    }
}

/// Constants and start states, neuron by neuron.
fn values<M: Model<C, Z>, const C: usize, const Z: usize>(
    network: &Network,
    phenotype: &Phenotype,
) -> [Vec<Vec<f32>>; 2] {
    let Neurons { constants, starts, .. } = Neurons::<M, C, Z>::compile(network, phenotype);
    let constants = constants.iter().map(|values| values.to_vec()).collect();
    [constants, starts.iter().map(|values| values.to_vec()).collect()]
}

/// The synapses of each of `n` groups.
pub(super) fn links(synapses: &Weighted, n: usize) -> Vec<Vec<Link>> {
    let of_group = |group| {
        let members = synapses.synapses_of(group).iter().zip(synapses.numbers_of(group));
        let link = |(&(other, weight), &synapse): (&(u32, f32), &usize)| Link {
            other: other as usize,
            weight,
            synapse,
        };
        members.map(link).collect()
    };
    (0..n).map(of_group).collect()
}

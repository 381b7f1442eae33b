//! Resolves queries of the genotype.

use std::ops::Range;

use super::Parameter;
use crate::network::Network;
use crate::network::connections::Source;
use experiment_file::{
    EnsembleSelector, GeneScale, GenotypeQuery, GroupSelector, OutputSelector, StimulusSelector,
    SynapseSelector, TopologyConfig,
};

/// The parameters that a query covers, in genotype order, and the scale of its genes.
pub(super) fn select(
    query: &GenotypeQuery,
    config: &TopologyConfig,
    network: &Network,
) -> (Vec<Parameter>, GeneScale) {
    match query {
        GenotypeQuery::Weights(selector) => (select_weights(selector, network), GeneScale::Linear),
        GenotypeQuery::Neurons(name, selector) => {
            let mut parameters = network.model.spec().parameters.iter().enumerate();
            let named = parameters.find(|(_, parameter)| parameter.name() == *name);
            let Some((parameter, scale)) = named.and_then(|(i, p)| Some((i, p.gene?))) else {
                return (Vec::new(), GeneScale::Linear);
            };
            let parameters =
                neurons_of(selector, network).map(|neuron| Parameter::Neuron { parameter, neuron });
            (parameters.collect(), scale)
        }
        GenotypeQuery::Delays(selector) => {
            let axons = axons_of(selector, network).filter(|&axon| axon < network.n_delays());
            (axons.map(Parameter::Delay).collect(), GeneScale::Linear)
        }
        GenotypeQuery::Learning(selector) => {
            let groups = network.groups.iter().enumerate();
            let selected = groups.filter(|(_, (name, group))| {
                group.is_plastic
                    && match selector {
                        GroupSelector::All => true,
                        GroupSelector::Named(selected) => selected == *name,
                    }
            });
            let parameters = selected.flat_map(|(group, _)| {
                (0..4).map(move |index| Parameter::Coefficient { group, index })
            });
            (parameters.collect(), GeneScale::Linear)
        }
        GenotypeQuery::Encoders(selector) => {
            let stimuli = network.stimuli.iter().filter(|(_, stimulus)| stimulus.encoder.is_some());
            let selected = stimuli.enumerate().filter(|(_, (name, _))| match selector {
                StimulusSelector::All => true,
                StimulusSelector::Named(selected) => selected == *name,
            });
            let parameters = selected.flat_map(|(encoder, (_, stimulus))| {
                let n_weights = stimulus.encoder.as_ref().map_or(0, |encoder| encoder.n_weights);
                (0..n_weights).map(move |weight| Parameter::Encoder { encoder, weight })
            });
            (parameters.collect(), GeneScale::Linear)
        }
        GenotypeQuery::Decoders(selector) => {
            let outputs = config.outputs.keys().zip(&network.outputs).enumerate();
            let selected = outputs.filter(|(_, (name, _))| match selector {
                OutputSelector::All => true,
                OutputSelector::Named(selected) => selected == *name,
            });
            let parameters = selected.flat_map(|(output, (_, compiled))| {
                (0..compiled.n_weights).map(move |weight| Parameter::Decoder { output, weight })
            });
            (parameters.collect(), GeneScale::Linear)
        }
    }
}

fn neurons_of(selector: &EnsembleSelector, network: &Network) -> Range<usize> {
    match selector {
        EnsembleSelector::All => 0..network.n_neurons(),
        EnsembleSelector::Named(name) => {
            network.ensembles.get(name).map_or(0..0, |ensemble| ensemble.neurons.clone())
        }
    }
}

/// Axons with a delay: those of neurons, and then of nodes of encoders.
fn axons_of(selector: &EnsembleSelector, network: &Network) -> Range<usize> {
    let n_neurons = network.n_neurons();
    match selector {
        EnsembleSelector::All => 0..n_neurons + network.n_encoded(),
        EnsembleSelector::Named(name) => {
            let encoder = network.stimuli.get(name).and_then(|stimulus| stimulus.encoder.as_ref());
            match encoder {
                Some(encoder) => n_neurons + encoder.nodes.start..n_neurons + encoder.nodes.end,
                None => neurons_of(selector, network),
            }
        }
    }
}

/// Synapses by name: of a group, a stimulus or an ensemble. The reader of experiment files
/// refuses ambiguous names.
fn select_weights(selector: &SynapseSelector, network: &Network) -> Vec<Parameter> {
    let is_motor = |neuron: &usize| {
        let mut ensembles = network.ensembles.values();
        ensembles.any(|ensemble| ensemble.motor && ensemble.neurons.contains(neuron))
    };
    let trainable = network.groups.iter().filter(|(_, group)| group.trainable);
    let selected = trainable.flat_map(|(group_name, group)| {
        group.synapses.clone().filter(move |&synapse| {
            let pre = network.synapses[synapse].pre;
            match (selector, pre) {
                (SynapseSelector::All, _) => true,
                (SynapseSelector::Sensory, pre) => !matches!(pre, Source::Neuron(_)),
                (SynapseSelector::Hidden, Source::Neuron(neuron)) => !is_motor(&neuron),
                (SynapseSelector::Motor, Source::Neuron(neuron)) => is_motor(&neuron),
                (SynapseSelector::Hidden | SynapseSelector::Motor, _) => false,
                (SynapseSelector::Named(name), _) if name == group_name => true,
                (SynapseSelector::Named(name), Source::Input(input)) => {
                    network.stimuli.get(name).is_some_and(|s| s.inputs.contains(&input))
                }
                (SynapseSelector::Named(name), Source::Encoded(node)) => {
                    let stimulus = network.stimuli.get(name);
                    let encoder = stimulus.and_then(|stimulus| stimulus.encoder.as_ref());
                    encoder.is_some_and(|encoder| encoder.nodes.contains(&node))
                }
                (SynapseSelector::Named(name), Source::Neuron(neuron)) => {
                    network.ensembles.get(name).is_some_and(|e| e.neurons.contains(&neuron))
                }
            }
        })
    });
    selected.map(Parameter::Weight).collect()
}

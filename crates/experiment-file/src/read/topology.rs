//! Reads `topology`.

use super::encoding;
use super::node::{Node, Object};
use crate::parameters::{self, Choice};
use crate::semantics::Semantics;
use crate::{
    Activation, DecodingConfig, EnsembleConfig, InitialRates, NamedMap, NeuronModel,
    Neurotransmitter, ParameterValue, Parameters, SynapseGroupConfig, SynapseModel, SynapseParams,
    TopologyConfig, limits,
};

pub(super) fn topology(o: &mut Object<'_>, semantics: Semantics) -> TopologyConfig {
    let model = neuron_model(o);
    let is_spiking = model.is_some_and(NeuronModel::is_spiking);
    let mut given = vec![("neuron_model", model.unwrap_or_default().into()), ("dt", 0.1.into())];
    if is_spiking {
        given[1].1 = o.or("dt", 1.0, |node| node.number(limits::SPIKING_DT)).into();
        for (key, value) in [
            ("bias_in_gain", true.into()),
            ("initial_rates", InitialRates::default().into()),
            ("motor_tau", ParameterValue::Null),
        ] {
            o.optional(key).iter().for_each(|node| {
                node.problem("only rate neurons have this key; these neurons spike")
            });
            given.push((key, value));
        }
    }
    let topology: TopologyConfig = parameters::read(o, semantics, &given);
    let synapse_model = topology.synapse_model;
    if synapse_model == SynapseModel::Dynamic && model.is_some() && !is_spiking {
        o.problem("synapse_model", "dynamic synapses need spiking neurons");
    }
    let stimuli = o.required("stimuli").map(1, |_, node| node.object(plain));
    let encoding = encoding::encodings(o, &stimuli, topology.time_scale);
    let synapses: NamedMap<_> =
        o.required("synapses").map(1, |_, node| node.object(|o| synapse_group(o, synapse_model)));
    let learning = o.optional("learning").and_then(|node| {
        let groups: Vec<String> = synapses.keys().cloned().collect();
        let max_weight = if is_spiking { 1_000.0 } else { 10.0 };
        let given = [("max_weight", max_weight.into()), ("synapses", groups.into())];
        node.or_null(|node| node.object(|o| parameters::read(o, semantics, &given)))
    });
    TopologyConfig {
        synapse_params: synapse_params(o, synapse_model),
        stimuli,
        encoding,
        ensembles: o.required("ensembles").map(1, |_, node| node.object(|o| ensemble(o, model))),
        outputs: o.required("outputs").map(1, |_, node| node.object(plain)),
        synapses,
        learning,
        decoding: o.required("decoding").map(1, |_, node| node.object(decoding)),
        ..topology
    }
}

/// The model, which a file may name in two places; `None` if it is unreadable.
fn neuron_model(o: &mut Object<'_>) -> Option<NeuronModel> {
    let named =
        |node: Node<'_>| node.one_of(&NeuronModel::names(), &[]).and_then(NeuronModel::named);
    let outer = o.optional("neuron_model").map(named);
    let inner = o.optional("neurons").map(|node| node.object(|o| named(o.required("model"))));
    if let (Some(Some(outer)), Some(Some(inner))) = (outer, inner)
        && outer != inner
    {
        o.problem("neuron_model", "`neurons` names another model");
    }
    outer.or(inner).unwrap_or(Some(NeuronModel::default()))
}

/// Reads an object that depends on no other part.
fn plain<T: Parameters>(o: &mut Object<'_>) -> T {
    parameters::read(o, Semantics::Thesis, &[])
}

/// Reads an ensemble. `model`: `None` if it is unreadable, so that the allowed parameters are
/// unknown.
fn ensemble(o: &mut Object<'_>, model: Option<NeuronModel>) -> EnsembleConfig {
    let ensemble: EnsembleConfig = plain(o);
    let Some(spec) = model.map(NeuronModel::spec) else {
        for key in ["activation", "params"] {
            o.optional(key);
        }
        return ensemble;
    };
    let activation = |o: &mut Object<'_>| -> Option<Activation> {
        spec.activation?;
        o.optional("activation").and_then(|node| node.variant(&[]))
    };
    let outer = activation(o);
    let (params, inner) = o.inner("params", |o| {
        let params = parameters::params(o, &spec.table(), Semantics::Thesis, &[]);
        let params =
            params.iter().filter_map(|(key, value)| Some((key.to_owned(), value.number()?)));
        (params.collect(), activation(o))
    });
    if let (Some(outer), Some(inner)) = (outer, inner)
        && outer != inner
    {
        o.problem("activation", "`params` has another activation");
    }
    EnsembleConfig { activation: outer.or(inner).or(spec.activation), params, ..ensemble }
}

/// `None` for static synapses.
fn synapse_params(o: &mut Object<'_>, model: SynapseModel) -> Option<SynapseParams> {
    if model == SynapseModel::Static {
        o.ignored("synapse_params", "static synapses have no parameters");
        return None;
    }
    let thesis = Semantics::Thesis;
    Some(o.inner("synapse_params", |o| SynapseParams {
        ampa: parameters::inner(o, "AMPA", thesis, &[]),
        gaba: parameters::inner(o, "GABA", thesis, &[]),
        nmda: match parameters::optional(o, "NDMA", thesis, &[]) {
            Some(nmda) => nmda,
            None => parameters::inner(o, "NMDA", thesis, &[]),
        },
    }))
}

fn synapse_group(o: &mut Object<'_>, model: SynapseModel) -> SynapseGroupConfig {
    let transmitter = match model {
        SynapseModel::Static => {
            for key in ["neuroTX", "ntx_fixed"] {
                o.ignored(key, "static synapses have no neurotransmitter");
            }
            None
        }
        SynapseModel::Dynamic => {
            if !o.or("ntx_fixed", true, Node::bool) {
                o.problem("ntx_fixed", "not supported: the file determines the transmitters");
            }
            Some(o.or("neuroTX", Neurotransmitter::default(), |node| {
                node.variant(&[]).unwrap_or_default()
            }))
        }
    };
    SynapseGroupConfig { transmitter, ..plain(o) }
}

fn decoding(o: &mut Object<'_>) -> DecodingConfig {
    let choice = Choice::any::<DecodingConfig>(&["ArgmaxDecoding"]);
    let decoding = parameters::read_kind(o, &choice, Semantics::Thesis, &[]);
    decoding.unwrap_or(DecodingConfig::IdentityDecoding {})
}

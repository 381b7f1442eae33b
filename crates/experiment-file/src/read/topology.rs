//! Reads `topology`.

use super::encoding;
use super::node::{Node, Object};
use crate::parameters::{self, Choice};
use crate::semantics::Semantics;
use crate::topology::{
    DEFAULT_CONNECTION_SEED, DEFAULT_DT, DEFAULT_SPIKING_DT, DEFAULT_TIME_SCALE,
};
use crate::{
    Activation, DecodingConfig, EnsembleConfig, InitialRates, NamedMap, NeuronModel,
    Neurotransmitter, Parameters, SynapseGroupConfig, SynapseModel, SynapseParams, TopologyConfig,
    limits,
};

pub(super) fn topology(o: &mut Object<'_>, semantics: Semantics) -> TopologyConfig {
    let model = neuron_model(o);
    let stimuli = o.required("stimuli").map(1, |_, node| node.object(plain));
    let time_scale = o.or("time_scale", DEFAULT_TIME_SCALE, |n| n.u32(1..=limits::TIME_SCALE));
    let encoding = encoding::encodings(o, &stimuli, time_scale);
    let is_spiking = model.is_some_and(NeuronModel::is_spiking);
    let dt = if is_spiking {
        o.or("dt", DEFAULT_SPIKING_DT, |node| node.number(limits::SPIKING_DT))
    } else {
        o.or("dt", DEFAULT_DT, Node::positive)
    };
    let (bias_in_gain, initial_rates, motor_tau) =
        if is_spiking { of_spiking_neurons(o) } else { of_rate_neurons(o, semantics) };
    let synapse_model: SynapseModel =
        o.or("synapse_model", SynapseModel::Static, |node| node.variant(&[]).unwrap_or_default());
    if synapse_model == SynapseModel::Dynamic && model.is_some() && !is_spiking {
        o.problem("synapse_model", "dynamic synapses need neurons that spike");
    }
    let synapses: NamedMap<_> =
        o.required("synapses").map(1, |_, node| node.object(|o| synapse_group(o, synapse_model)));
    let learning = o.optional("learning").and_then(|node| {
        let groups: Vec<String> = synapses.keys().cloned().collect();
        let max_weight = if is_spiking { 1_000.0 } else { 10.0 };
        let given = [("max_weight", max_weight.into()), ("synapses", groups.into())];
        node.or_null(|node| node.object(|o| parameters::read(o, semantics, &given)))
    });
    TopologyConfig {
        dt,
        time_scale,
        seed: o.or("seed", DEFAULT_CONNECTION_SEED, Node::seed),
        neuron_model: model.unwrap_or_default(),
        bias_in_gain,
        initial_rates,
        motor_tau,
        synapse_params: synapse_params(o, synapse_model),
        synapse_model,
        stimuli,
        encoding,
        ensembles: o.required("ensembles").map(1, |_, node| node.object(|o| ensemble(o, model))),
        outputs: o.required("outputs").map(1, |_, node| node.object(plain)),
        synapses,
        learning,
        decoding: o.required("decoding").map(1, |_, node| node.object(decoding)),
    }
}

/// `bias_in_gain`, `initial_rates` and `motor_tau`.
fn of_rate_neurons(o: &mut Object<'_>, semantics: Semantics) -> (bool, InitialRates, Option<f64>) {
    let initial_rates = |node: Node<'_>| node.variant(&[]).unwrap_or_default();
    (
        o.or("bias_in_gain", semantics.bias_in_gain(), Node::bool),
        o.or("initial_rates", semantics.initial_rates(), initial_rates),
        o.or("motor_tau", semantics.motor_tau(), |node| node.or_null(Node::positive)),
    )
}

/// The same keys where nothing has a rate.
fn of_spiking_neurons(o: &mut Object<'_>) -> (bool, InitialRates, Option<f64>) {
    for key in ["bias_in_gain", "initial_rates", "motor_tau"] {
        if let Some(node) = o.optional(key) {
            node.problem("a key of rate neurons; these spike");
        }
    }
    (true, InitialRates::default(), None)
}

/// The model, which a file may name in two places; none if it is unreadable.
fn neuron_model(o: &mut Object<'_>) -> Option<NeuronModel> {
    let named =
        |node: Node<'_>| node.one_of(&NeuronModel::names(), &[]).and_then(NeuronModel::named);
    let outer = o.optional("neuron_model").map(named);
    let inner = o.optional("neurons").map(|node| node.object(|o| named(o.required("model"))));
    if let (Some(Some(outer)), Some(Some(inner))) = (outer, inner)
        && outer != inner
    {
        o.problem("neuron_model", "`neurons` has another one");
    }
    outer.or(inner).unwrap_or(Some(NeuronModel::default()))
}

/// What depends on nothing else.
fn plain<T: Parameters>(o: &mut Object<'_>) -> T {
    parameters::read(o, Semantics::Thesis, &[])
}

/// `model`: none if it is unreadable; then nobody can tell which parameters are
/// right.
fn ensemble(o: &mut Object<'_>, model: Option<NeuronModel>) -> EnsembleConfig {
    let n = o.required("n").u32(1..=limits::NEURONS);
    let Some(spec) = model.map(NeuronModel::spec) else {
        for key in ["activation", "params"] {
            o.optional(key);
        }
        return EnsembleConfig { n, activation: None, params: NamedMap::new() };
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
        o.problem("activation", "`params` has another one");
    }
    EnsembleConfig { n, activation: outer.or(inner).or(spec.activation), params }
}

/// None of static synapses.
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
                o.problem("ntx_fixed", "not supported: transmitters are those of the file");
            }
            Some(o.or("neuroTX", Neurotransmitter::default(), |node| {
                node.variant(&[]).unwrap_or_default()
            }))
        }
    };
    SynapseGroupConfig {
        pre: o.required("pre").names(),
        post: o.required("post").names(),
        trainable: o.or("trainable", true, Node::bool),
        p: o.or("p", 1.0, Node::probability),
        transmitter,
    }
}

fn decoding(o: &mut Object<'_>) -> DecodingConfig {
    let choice = Choice::any::<DecodingConfig>(&["ArgmaxDecoding"]);
    let decoding = parameters::read_kind(o, &choice, Semantics::Thesis, &[]);
    decoding.unwrap_or(DecodingConfig::IdentityDecoding {})
}

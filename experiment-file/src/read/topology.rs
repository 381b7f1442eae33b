//! Reads `topology`.

use super::node::{Node, Object};
use crate::report::suggestion;
use crate::sensors::{UNSUPPORTED, UNSUPPORTED_READINGS};
use crate::topology::{DEFAULT_CONNECTION_SEED, DEFAULT_DT, DEFAULT_TIME_SCALE};
use crate::{
    Activation, ActuatorQuery, DecodingConfig, EnsembleConfig, NamedMap, NeuronParams,
    OutputConfig, SensorQuery, StimulusConfig, SynapseGroupConfig, TopologyConfig, limits,
};

pub(super) fn topology(o: &mut Object<'_>) -> TopologyConfig {
    neuron_model(o);
    let stimuli = o.required("stimuli").map(1, |_, node| node.object(stimulus));
    if let Some(node) = o.optional("encoding") {
        node.map(0, |name, node| encoding(name, node, &stimuli));
    }
    TopologyConfig {
        dt: o.or("dt", DEFAULT_DT, Node::positive),
        time_scale: o.or("time_scale", DEFAULT_TIME_SCALE, |n| n.u32(1..=limits::TIME_SCALE)),
        seed: o.or("seed", DEFAULT_CONNECTION_SEED, |node| node.u64(0..=u64::MAX)),
        stimuli,
        ensembles: o.required("ensembles").map(1, |_, node| node.object(ensemble)),
        outputs: o.required("outputs").map(1, |_, node| node.object(output)),
        synapses: o.required("synapses").map(1, |_, node| node.object(synapse_group)),
        decoding: o.required("decoding").map(1, |_, node| node.object(decoding)),
    }
}

/// There is one model, so it need not be named.
fn neuron_model(o: &mut Object<'_>) {
    const KNOWN: [&str; 2] = ["rate_model", "ctrnn"];
    const SPIKING: [&str; 5] = ["adex", "izhikevich", "lif", "exp_lif", "morris_lecar"];
    if let Some(model) = o.optional("neuron_model") {
        model.one_of(&KNOWN, &SPIKING);
    }
    if let Some(neurons) = o.optional("neurons") {
        neurons.object(|o| o.required("model").one_of(&KNOWN, &SPIKING));
    }
    if let Some(model) = o.optional("synapse_model") {
        model.one_of(&["static_synapse"], &["dynamic_synapse"]);
    }
    o.ignored("synapse_params", "static synapses have no parameters");
}

fn stimulus(o: &mut Object<'_>) -> StimulusConfig {
    let unsupported = [&UNSUPPORTED[..], &UNSUPPORTED_READINGS[..]].concat();
    StimulusConfig {
        n: o.required("n").u32(1..=limits::INPUTS),
        sensor: o.required("sensor").variant(&unsupported).unwrap_or(SensorQuery::Ground),
    }
}

/// Rate neurons take stimuli as they are; the encodings are for spiking ones.
fn encoding(name: &str, node: Node<'_>, stimuli: &NamedMap<StimulusConfig>) {
    const SPIKING: [&str; 3] = ["LIF_Encoding", "PoissonRateCoding", "RankOrderCoding"];
    if !stimuli.is_empty() && !stimuli.contains_key(name) {
        let names: Vec<_> = stimuli.keys().collect();
        node.problem(|| format!("no stimulus has this name; {}", suggestion(name, &names)));
    }
    node.object(|o| {
        o.required("scheme").one_of(&["IdentityEncoding"], &SPIKING);
        o.ignored("receptive_field", "`IdentityEncoding` has none");
    });
}

fn ensemble(o: &mut Object<'_>) -> EnsembleConfig {
    let activation = |o: &mut Object<'_>| -> Option<Activation> {
        o.optional("activation").and_then(|node| node.variant(&[]))
    };
    let default = NeuronParams::default();
    let n = o.required("n").u32(1..=limits::NEURONS);
    let outer = activation(o);
    let (params, inner) = o.inner("params", |o| {
        let params = NeuronParams {
            tau: o.or("tau", default.tau, Node::positive),
            gain: o.or("gain", default.gain, Node::quantity),
            bias: o.or("bias", default.bias, Node::quantity),
        };
        (params, activation(o))
    });
    if let (Some(outer), Some(inner)) = (outer, inner)
        && outer != inner
    {
        o.problem("activation", "`params` has another one");
    }
    EnsembleConfig { n, activation: outer.or(inner).unwrap_or(Activation::Sigmoid), params }
}

fn output(o: &mut Object<'_>) -> OutputConfig {
    const UNSUPPORTED: [&str; 1] = ["wireless_transmitter:priority"];
    // Says what the decoding says, too; nothing depends on it.
    if let Some(enc) = o.optional("enc") {
        enc.one_of(&["real", "cat"], &[]);
    }
    OutputConfig {
        ensemble: o.required("ensemble").name(),
        actuator: o.required("actuator").variant(&UNSUPPORTED).unwrap_or(ActuatorQuery::Led),
    }
}

fn synapse_group(o: &mut Object<'_>) -> SynapseGroupConfig {
    for key in ["neuroTX", "ntx_fixed"] {
        o.ignored(key, "static synapses have no neurotransmitter");
    }
    SynapseGroupConfig {
        pre: o.required("pre").names(),
        post: o.required("post").names(),
        trainable: o.or("trainable", true, Node::bool),
        p: o.or("p", 1.0, Node::probability),
    }
}

fn decoding(o: &mut Object<'_>) -> DecodingConfig {
    const KNOWN: [&str; 3] = ["IdentityDecoding", "ThresholdDecoding", "SoftmaxDecoding"];
    const UNSUPPORTED: [&str; 4] =
        ["ArgmaxDecoding", "FirstToSpike", "LinearPopulationDecoding", "RankOrderDecoding"];
    let Some(scheme) = o.required("scheme").one_of(&KNOWN, &UNSUPPORTED) else {
        o.accept_rest();
        return DecodingConfig::IdentityDecoding {};
    };
    o.inner("params", |o| {
        // Says what the scheme says, too; nothing depends on it.
        o.or("is_cat", false, Node::bool);
        match scheme {
            "ThresholdDecoding" => DecodingConfig::ThresholdDecoding {
                stochastic: o.or("stochastic", false, Node::bool),
            },
            "SoftmaxDecoding" => DecodingConfig::SoftmaxDecoding {},
            _ => DecodingConfig::IdentityDecoding {},
        }
    })
}

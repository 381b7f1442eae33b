//! Reads `topology`.

use super::node::{Node, Object};
use super::{encoding, learning};
use crate::semantics::Semantics;
use crate::sensors::{UNSUPPORTED, UNSUPPORTED_READINGS};
use crate::topology::{
    DEFAULT_CONNECTION_SEED, DEFAULT_DT, DEFAULT_SPIKING_DT, DEFAULT_TIME_SCALE,
};
use crate::{
    Activation, ActuatorQuery, AmpaParams, DecodingConfig, EnsembleConfig, GabaParams,
    InitialRates, NamedMap, NeuronModel, Neurotransmitter, NmdaParams, OutputConfig, SensorQuery,
    StimulusConfig, SynapseGroupConfig, SynapseModel, SynapseParams, TopologyConfig, limits,
    neuron,
};

pub(super) fn topology(o: &mut Object<'_>, semantics: Semantics) -> TopologyConfig {
    let model = neuron_model(o);
    let stimuli = o.required("stimuli").map(1, |_, node| node.object(stimulus));
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
        let groups = synapses.keys().cloned();
        node.or_null(|node| node.object(|o| learning::learning(o, is_spiking, groups)))
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
        outputs: o.required("outputs").map(1, |_, node| node.object(output)),
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

fn stimulus(o: &mut Object<'_>) -> StimulusConfig {
    let unsupported = [&UNSUPPORTED[..], &UNSUPPORTED_READINGS[..]].concat();
    StimulusConfig {
        n: o.required("n").u32(1..=limits::INPUTS),
        sensor: o.required("sensor").variant(&unsupported).unwrap_or(SensorQuery::Ground),
    }
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
        let parameters = spec.parameters.iter().map(|parameter| {
            let (min, max) = (*parameter.range.start(), *parameter.range.end());
            let read = |node: Node<'_>| {
                if parameter.is_whole {
                    f64::from(node.u32(min as u32..=max as u32))
                } else {
                    node.number(min..=max)
                }
            };
            (parameter.name.to_owned(), o.or(parameter.name, parameter.default, read))
        });
        (parameters.collect(), activation(o))
    });
    if let (Some(outer), Some(inner)) = (outer, inner)
        && outer != inner
    {
        o.problem("activation", "`params` has another one");
    }
    EnsembleConfig { n, activation: outer.or(inner).or(spec.activation), params }
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

/// None of static synapses.
fn synapse_params(o: &mut Object<'_>, model: SynapseModel) -> Option<SynapseParams> {
    if model == SynapseModel::Static {
        o.ignored("synapse_params", "static synapses have no parameters");
        return None;
    }
    let gain = |o: &mut Object<'_>, default: f64| {
        o.or("gain", default, |node| node.number(0.0..=limits::SYNAPSE_GAIN))
    };
    let tau = |o: &mut Object<'_>, key: &'static str, default: f64| {
        o.or(key, default, |node| node.number(neuron::TIME))
    };
    let reversal = |o: &mut Object<'_>, default: Option<f64>| {
        o.or("E", default, |node| node.or_null(|node| node.number(neuron::VOLTAGE)))
    };
    Some(o.inner("synapse_params", |o| {
        let SynapseParams { ampa, gaba, nmda } = SynapseParams::default();
        let nmda_params = |o: &mut Object<'_>| NmdaParams {
            gain: gain(o, nmda.gain),
            tau_rise: tau(o, "tau_rise", nmda.tau_rise),
            tau_decay: tau(o, "tau_decay", nmda.tau_decay),
            magnesium: o.or("Mg2", nmda.magnesium, |node| node.number(0.0..=1_000.0)),
            reversal: reversal(o, nmda.reversal),
        };
        SynapseParams {
            ampa: o.inner("AMPA", |o| AmpaParams {
                gain: gain(o, ampa.gain),
                tau: tau(o, "tau", ampa.tau),
                reversal: reversal(o, ampa.reversal),
            }),
            gaba: o.inner("GABA", |o| GabaParams {
                gain: gain(o, gaba.gain),
                tau: tau(o, "tau", gaba.tau),
                reversal: reversal(o, gaba.reversal),
            }),
            nmda: match o.optional("NDMA") {
                Some(node) => node.object(nmda_params),
                None => o.inner("NMDA", nmda_params),
            },
        }
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
    const KNOWN: [&str; 6] = [
        "IdentityDecoding",
        "ThresholdDecoding",
        "SoftmaxDecoding",
        "FirstToSpike",
        "RankOrderDecoding",
        "LinearPopulationDecoding",
    ];
    let Some(scheme) = o.required("scheme").one_of(&KNOWN, &["ArgmaxDecoding"]) else {
        o.accept_rest();
        return DecodingConfig::IdentityDecoding {};
    };
    let num_outputs =
        |o: &mut Object<'_>| o.or("num_outputs", 1, |node| node.u32(1..=limits::MESSAGE_LENGTH));
    o.inner("params", |o| {
        // Says what the scheme says, too; nothing depends on it.
        o.or("is_cat", false, Node::bool);
        match scheme {
            "ThresholdDecoding" => DecodingConfig::ThresholdDecoding {
                stochastic: o.or("stochastic", false, Node::bool),
            },
            "SoftmaxDecoding" => DecodingConfig::SoftmaxDecoding {},
            "FirstToSpike" => {
                o.ignored("num_outputs", "there are as many as neurons");
                DecodingConfig::FirstToSpike {}
            }
            "RankOrderDecoding" => {
                DecodingConfig::RankOrderDecoding { num_outputs: num_outputs(o) }
            }
            "LinearPopulationDecoding" => DecodingConfig::LinearPopulationDecoding {
                num_outputs: num_outputs(o),
                rest_value: o.or("rest_value", 0.5, |node| node.number(-1.0..=1.0)),
            },
            _ => DecodingConfig::IdentityDecoding {},
        }
    })
}

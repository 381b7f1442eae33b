//! Checks the network itself: names, groups, outputs and their decoding.

use std::collections::{BTreeMap, BTreeSet};

use super::{encoding, learning};
use crate::report::{Path, Report, suggestion};
use crate::{ActuatorQuery, DecodingConfig, SynapseParams, TopologyConfig};

pub(super) fn check(topology: &TopologyConfig, report: &Report<'_>) {
    names(topology, report);
    inputs(topology, report);
    groups(topology, report);
    outputs(topology, report);
    decoding(topology, report);
    motor_tau(topology, report);
    receptors(topology, report);
    encoding::check(topology, report);
    if let Some(config) = &topology.learning {
        learning::check(topology, config, report);
    }
}

/// Euler steps longer than a time constant would make the state of receptors negative.
fn receptors(topology: &TopologyConfig, report: &Report<'_>) {
    let Some(SynapseParams { ampa, gaba, nmda }) = topology.synapse_params else { return };
    for (receptor, key, tau) in [
        ("AMPA", "tau", ampa.tau),
        ("GABA", "tau", gaba.tau),
        ("NMDA", "tau_rise", nmda.tau_rise),
        ("NMDA", "tau_decay", nmda.tau_decay),
    ] {
        if tau < topology.dt {
            let path = Path::from(["topology", "synapse_params", receptor, key]);
            report.conflict(&path, &[&Path::from(["topology", "dt"])], || {
                format!("{tau} ms is below dt: the receptors would overshoot")
            });
        }
    }
}

/// Euler steps longer than twice the time constant diverge.
fn motor_tau(topology: &TopologyConfig, report: &Report<'_>) {
    let Some(tau) = topology.motor_tau.filter(|tau| *tau < topology.dt / 2.0) else { return };
    let [path, dt] = ["motor_tau", "dt"].map(|key| Path::from(["topology", key]));
    report.conflict(&path, &[&dt], || {
        format!("{tau} s is below dt / 2: the network would be unstable")
    });
}

/// Synapse groups refer to stimuli and ensembles alike.
fn names(topology: &TopologyConfig, report: &Report<'_>) {
    for name in topology.ensembles.keys() {
        if topology.stimuli.contains_key(name) {
            let path = Path::from(["topology", "ensembles", name]);
            report.conflict(&path, &[], "a stimulus has the same name");
        }
    }
}

/// Warns of a network without input, which is rarely intended.
fn inputs(topology: &TopologyConfig, report: &Report<'_>) {
    let is_used = |stimulus: &String| {
        topology.synapses.values().any(|group| group.p > 0.0 && group.pre.contains(stimulus))
    };
    let path = Path::from(["topology", "stimuli"]);
    if !topology.stimuli.keys().any(is_used) {
        return report
            .warning(&path, "no synapse group starts from a stimulus: the network has no input");
    }
    for stimulus in topology.stimuli.keys().filter(|stimulus| !is_used(stimulus)) {
        report.warning(
            &path.key(stimulus),
            "no synapse group starts from this stimulus: the network does not receive it",
        );
    }
}

/// Groups name ensembles and stimuli, and no two connect the same pair.
fn groups(topology: &TopologyConfig, report: &Report<'_>) {
    let sources: Vec<&str> = source_names(topology).collect();
    let n_targets = topology.ensembles.len();
    let mut connected: Vec<Option<&str>> = vec![None; sources.len() * n_targets];
    for (name, group) in &topology.synapses {
        let path = Path::from(["topology", "synapses", name]);
        let pre = resolve(&group.pre, &sources, topology, &path.key("pre"), report);
        let post = resolve(&group.post, &sources[..n_targets], topology, &path.key("post"), report);
        let mut clash = None;
        for (&pre, &post) in pre.iter().flat_map(|pre| post.iter().map(move |post| (pre, post))) {
            let cell = &mut connected[pre * n_targets + post];
            match *cell {
                None => *cell = Some(name),
                Some(other) => clash = clash.or(Some((pre, post, other))),
            }
        }
        if let Some((pre, post, other)) = clash {
            let (pre, post) = (sources[pre], sources[post]);
            let message = || format!("connects `{pre}` to `{post}`, as group `{other}` does");
            report.conflict(&path, &[&Path::from(["topology", "synapses", other])], message);
        }
    }
}

/// The possible sources of a synapse; the ensembles, which are also possible targets, come first.
fn source_names(topology: &TopologyConfig) -> impl Iterator<Item = &str> {
    topology.ensembles.keys().chain(topology.stimuli.keys()).map(String::as_str)
}

/// The indices of names in `known`, which is a prefix of [`source_names`].
fn resolve(
    names: &[String],
    known: &[&str],
    topology: &TopologyConfig,
    path: &Path,
    report: &Report<'_>,
) -> BTreeSet<usize> {
    let TopologyConfig { ensembles, stimuli, .. } = topology;
    let mut found = BTreeSet::new();
    for (i, name) in names.iter().enumerate() {
        let stimulus = || stimuli.get_index_of(name).map(|index| ensembles.len() + index);
        let index = ensembles.get_index_of(name).or_else(stimulus);
        match index.filter(|&index| index < known.len()) {
            None => {
                let others =
                    ["stimuli", "ensembles"].map(|map| Path::from(["topology", map]).keys());
                let what =
                    if known.len() > ensembles.len() { "ensemble or stimulus" } else { "ensemble" };
                report.conflict(&path.index(i), &others.each_ref(), || {
                    format!("no {what} is named `{name}`; {}", suggestion(name, known))
                });
            }
            Some(index) if !found.insert(index) => {
                report.conflict(&path.index(i), &[], || format!("names `{name}` twice"));
            }
            Some(_) => {}
        }
    }
    found
}

/// Outputs connect ensembles to actuators, and no two outputs drive the same actuator.
fn outputs(topology: &TopologyConfig, report: &Report<'_>) {
    let ensembles: Vec<&String> = topology.ensembles.keys().collect();
    let mut drivers: BTreeMap<ActuatorQuery, &str> = BTreeMap::new();
    for (name, output) in &topology.outputs {
        let path = Path::from(["topology", "outputs", name]);
        let ensemble = &output.ensemble;
        if !topology.ensembles.contains_key(ensemble) {
            let others = [&Path::from(["topology", "ensembles"]).keys()];
            report.conflict(&path.key("ensemble"), &others, || {
                format!("no ensemble is named `{ensemble}`; {}", suggestion(ensemble, &ensembles))
            });
        }
        if let Some(other) = drivers.insert(output.actuator, name) {
            let others = [&Path::from(["topology", "outputs", other, "actuator"])];
            report.conflict(&path.key("actuator"), &others, || {
                format!("output `{other}` drives the same actuator")
            });
        }
    }
}

/// Every output has a decoding whose values its actuator accepts.
fn decoding(topology: &TopologyConfig, report: &Report<'_>) {
    let path = Path::from(["topology", "decoding"]);
    let outputs_path = Path::from(["topology", "outputs"]);
    let names: Vec<&String> = topology.outputs.keys().collect();
    for name in topology.decoding.keys() {
        if !topology.outputs.contains_key(name) {
            report.conflict(&path.key(name), &[&outputs_path.keys()], || {
                format!("no output has this name; {}", suggestion(name, &names))
            });
        }
    }
    for (name, output) in &topology.outputs {
        let Some(&decoding) = topology.decoding.get(name) else {
            report.conflict(&path.key(name), &[], || {
                format!("missing key `{name}`: every output needs a decoding")
            });
            continue;
        };
        let Some(ensemble) = topology.ensembles.get(&output.ensemble) else {
            continue;
        };
        let ensemble_path = Path::from(["topology", "ensembles", &output.ensemble]);
        let [model, neurons] = ["neuron_model", "neurons"].map(|key| Path::from(["topology", key]));
        let others = [&outputs_path.key(name), &ensemble_path, &model, &neurons];
        if decoding.is_of_spikes() != topology.neuron_model.is_spiking() {
            report.conflict(&path.key(name), &others, || {
                let model = topology.neuron_model.name();
                let what = if decoding.is_of_spikes() { "spikes" } else { "activities" };
                format!("decodes {what}, which `{model}` neurons do not have")
            });
            continue;
        }
        if let Err(message) = accepts(output.actuator, decoding, ensemble.n) {
            report.conflict(&path.key(name), &others, message);
        }
    }
}

/// Whether an actuator accepts the values that a decoding makes of `n` neurons. (The transmitter
/// determines the length of messages.)
fn accepts(actuator: ActuatorQuery, decoding: DecodingConfig, n: u32) -> Result<(), String> {
    use ActuatorQuery::{Led, Message, Mode, Wheels};
    use DecodingConfig::{
        FirstToSpike, IdentityDecoding, LinearPopulationDecoding, RankOrderDecoding,
        SoftmaxDecoding, ThresholdDecoding,
    };
    if let RankOrderDecoding { num_outputs } | LinearPopulationDecoding { num_outputs, .. } =
        decoding
    {
        return match (actuator, num_outputs) {
            (Message, _) | (Wheels, 1 | 2) | (Led | Mode, 1) => Ok(()),
            (Wheels, _) => Err(format!("the actuator needs 1 or 2 outputs, not {num_outputs}")),
            (Led | Mode, _) => Err(format!("the actuator needs 1 output, not {num_outputs}")),
        };
    }
    let (sizes, expected) = match (actuator, decoding) {
        (Message, IdentityDecoding {} | ThresholdDecoding { .. }) => return Ok(()),
        (Wheels, IdentityDecoding {} | ThresholdDecoding { .. }) => (1..=2, "1 or 2 neurons"),
        (Led | Mode, ThresholdDecoding { .. }) => (1..=1, "1 neuron"),
        (Mode, FirstToSpike {}) => (2..=2, "2 neurons, relay and send"),
        (Led, SoftmaxDecoding {} | FirstToSpike {}) => {
            (2..=u32::MAX, "one neuron per colour, 2 or more")
        }
        (Led, _) => return Err("an LED needs `ThresholdDecoding` or `SoftmaxDecoding`".to_owned()),
        (Mode, _) => return Err("a mode needs `ThresholdDecoding`".to_owned()),
        (Wheels | Message, FirstToSpike {}) => {
            return Err("the actuator takes numbers, `FirstToSpike` yields a category".to_owned());
        }
        (Wheels | Message, _) => return Err("the actuator needs `IdentityDecoding`".to_owned()),
    };
    if sizes.contains(&n) {
        Ok(())
    } else {
        Err(format!("the actuator needs {expected}, the ensemble has {n}"))
    }
}

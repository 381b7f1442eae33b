//! Checks encoders: neurons must take spikes, and values must fit the fields and schemes.

use crate::report::{Path, Report};
use crate::{EncodingConfig, EncodingScheme, RadialField, TopologyConfig, limits};

/// The current that a LIF encoder needs to spike, from the defaults of `lif`: the distance
/// from `v_rest` to `thresh`, mV.
const LIF_THRESHOLD: f64 = 15.0;

pub(super) fn check(topology: &TopologyConfig, report: &Report<'_>) {
    for (name, encoding) in &topology.encoding {
        let path = Path::from(["topology", "encoding", name]);
        if !topology.neuron_model.is_spiking() {
            let others = ["neuron_model", "neurons"].map(|key| Path::from(["topology", key]));
            report.conflict(&path.key("scheme"), &others.each_ref(), || {
                format!(
                    "encodes into spikes, which `{}` neurons do not take; they take \
                     `IdentityEncoding`",
                    topology.neuron_model.name()
                )
            });
        }
        let n_nodes = topology.n_sources(name);
        let time_scale = Path::from(["topology", "time_scale"]);
        let stimulus = Path::from(["topology", "stimuli", name]);
        if encoding.scheme == EncodingScheme::RankOrder && n_nodes > topology.time_scale {
            report.conflict(&path, &[&time_scale, &stimulus], || {
                let substeps = topology.time_scale;
                format!("{n_nodes} nodes cannot be ranked in {substeps} substeps")
            });
        }
        if let Some(field) = encoding.receptive_field.radial() {
            radial(&field, encoding, topology, &path, report);
        }
    }
}

/// Order and range of a field with centres.
fn radial(
    field: &RadialField,
    encoding: &EncodingConfig,
    topology: &TopologyConfig,
    path: &Path,
    report: &Report<'_>,
) {
    let params = path.key("receptive_field").key("params");
    let [low, high] = ["min_val", "max_val"].map(|key| params.key(key));
    let [first, last] = field.centres;
    if field.n_neurons > 1 && first >= last {
        report.conflict(&params.key("max_stim"), &[&params.key("min_stim")], || {
            format!("{last} is not above `min_stim` {first}: all nodes would be the same")
        });
    }
    let [min, max] = field.values;
    if min > max {
        report.conflict(&high, &[&low], || {
            format!("{max} is below `min_val` {min}; `inverted` turns a field around")
        });
    }
    let (range, what) = match encoding.scheme {
        EncodingScheme::Lif => {
            if max <= LIF_THRESHOLD {
                report.conflict(&high, &[], || {
                    format!(
                        "no node would ever spike: {max} is its largest current, and a LIF \
                         neuron needs more than {LIF_THRESHOLD}"
                    )
                });
            }
            return;
        }
        EncodingScheme::PoissonRate => (limits::POISSON_RATE, "a rate"),
        EncodingScheme::RankOrder => (1.0..=f64::from(topology.time_scale), "a substep"),
    };
    let time_scale = Path::from(["topology", "time_scale"]);
    for (value, path) in [(min, &low), (max, &high)] {
        if !range.contains(&value) {
            report.conflict(path, &[&time_scale], || {
                let (min, max) = (range.start(), range.end());
                format!("{what} must be between {min} and {max}, is {value}")
            });
        }
    }
}

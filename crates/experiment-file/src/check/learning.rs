//! Checks plasticity: its names resolve, and its bounds are valid.

use crate::report::{Path, Report, suggestion};
use crate::{LearningConfig, TopologyConfig};

pub(super) fn check(topology: &TopologyConfig, learning: &LearningConfig, report: &Report<'_>) {
    let path = Path::from(["topology", "learning", "synapses"]);
    let groups = Path::from(["topology", "synapses"]).keys();
    let names: Vec<&String> = topology.synapses.keys().collect();
    for (i, name) in learning.synapses.iter().enumerate() {
        let path = path.index(i);
        if !topology.synapses.contains_key(name) {
            report.conflict(&path, &[&groups], || {
                format!("no synapse group is named `{name}`; {}", suggestion(name, &names))
            });
        } else if learning.synapses[..i].contains(name) {
            report.conflict(&path, &[], || format!("names `{name}` twice"));
        }
    }
}

//! Reads experiment files: text -> syntax tree -> values -> relations between
//! them. Each stage reports all it finds; nothing is accepted in part.

mod algorithm;
mod names;
mod node;
mod parse;
mod population;
mod report;
mod robot;
mod topology;
mod variant;
mod world;

pub use names::suggestion;
pub(super) use report::{Path, Report};

use names::check_name;
use node::{Node, Object};

use super::check::check;
use super::{ConfigError, ExperimentConfig, Problem};

/// See [`ExperimentConfig::from_json`].
pub(super) fn read(
    text: &str,
    default_name: &str,
) -> Result<(ExperimentConfig, Vec<Problem>), ConfigError> {
    // RFC 8259 lets readers ignore a byte order mark, and some editors write one.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let root = parse::parse(text)?;
    let report = Report::new(text, &root);
    let mut config = Node::root(&report, &root).object(|o| experiment(o, default_name));
    if report.is_complete() {
        check(&config, &report);
    }
    let warnings = report.finish()?;
    config.sort_decoding();
    Ok((config, warnings))
}

fn experiment(o: &mut Object<'_>, default_name: &str) -> ExperimentConfig {
    // Tells an editor where the schema is.
    o.optional("$schema").map(Node::string);
    let name = o.optional("name").map(Node::name);
    let checkpoint = o.optional("checkpoint_file").filter(|node| !node.is_null()).map(Node::name);
    let config = ExperimentConfig {
        name: name.or(checkpoint).unwrap_or_else(|| {
            if let Err(message) = check_name(default_name) {
                o.problem(
                    "name",
                    format!("`name` is missing, and the default does not serve: {message}"),
                );
            }
            default_name.to_owned()
        }),
        seed: o.or("seed", 0, |node| node.u64(0..=u64::MAX)),
        topology: o.required("topology").object(topology::topology),
        algorithm: o.required("algorithm").object(algorithm::algorithm),
        world: o.required("world").object(world::world),
    };
    for key in ["num_processes", "render"] {
        o.ignored(key, "it concerns the original simulator's processes and window");
    }
    config
}

impl ExperimentConfig {
    /// Gives `decoding` the order of `outputs`, so that equal experiments have
    /// equal canonical forms.
    fn sort_decoding(&mut self) {
        let outputs = &self.topology.outputs;
        self.topology.decoding.sort_by_cached_key(|name, _| outputs.get_index_of(name));
    }
}

//! Reads experiment files: text -> syntax tree -> values. Each stage reports all problems; no
//! file is accepted in part. `check` then compares the values with each other.

mod algorithm;
mod encoding;
mod parse;
mod plain;
mod population;
mod robot;
mod task;
mod topology;
mod world;

pub(super) use parse::parse;
pub use plain::plain;

use crate::node::{self, Node, Object};
use jsonc_parser::ast::Value;

use super::report::{Report, check_name};
use super::semantics::Semantics;
use super::{AlgorithmDescription, ExperimentConfig};

/// The algorithms that a file may name.
#[derive(Clone, Copy)]
pub(super) enum Algorithms {
    /// The described algorithms.
    Described(&'static [AlgorithmDescription]),
    /// Any: the file is a canonical form whose algorithm was checked before.
    Unchecked,
}

/// Reads the experiment of a syntax tree. Reports unreadable values, and puts placeholders in
/// their places.
pub(super) fn read<'a>(
    report: &'a Report<'a>,
    root: &'a Value<'a>,
    default_name: &str,
    algorithms: Algorithms,
) -> ExperimentConfig {
    let read = |o: &mut Object<'_>| experiment(o, default_name, algorithms);
    let mut config = Node::root(report, root).object(read);
    config.sort_decoding();
    config
}

fn experiment(o: &mut Object<'_>, default_name: &str, algorithms: Algorithms) -> ExperimentConfig {
    // `$schema` tells an editor where the schema is.
    o.optional("$schema").map(Node::string);
    let name = o.optional("name").map(Node::name);
    let checkpoint = o.optional("checkpoint_file").filter(|node| !node.is_null()).map(Node::name);
    let semantics =
        o.or("semantics", Semantics::default(), |node| node.variant(&[]).unwrap_or_default());
    let config = ExperimentConfig {
        name: name.or(checkpoint).unwrap_or_else(|| {
            if let Err(message) = check_name(default_name) {
                o.problem(
                    "name",
                    format!("`name` is missing, and the default name is invalid: {message}"),
                );
            }
            default_name.to_owned()
        }),
        seed: o.or("seed", 0, Node::seed),
        topology: o.required("topology").object(|o| topology::topology(o, semantics)),
        algorithm: {
            let has_task = o.has("task");
            o.required("algorithm").object(|o| algorithm::algorithm(o, algorithms, has_task))
        },
        world: o.required("world").object(|o| world::world(o, semantics)),
        task: o.optional("task").map(|node| node.object(task::task)),
    };
    for key in ["num_processes", "render"] {
        o.ignored(key, "it concerns the original simulator's processes and window");
    }
    config
}

impl Algorithms {
    /// The description of the algorithm of this name, if algorithms are checked.
    pub(super) fn find(self, name: &str) -> Option<&'static AlgorithmDescription> {
        match self {
            Self::Described(algorithms) => AlgorithmDescription::find(algorithms, name),
            Self::Unchecked => None,
        }
    }
}

impl ExperimentConfig {
    /// Gives `decoding` the order of `outputs`, so that equal experiments have
    /// equal canonical forms.
    fn sort_decoding(&mut self) {
        let outputs = &self.topology.outputs;
        self.topology.decoding.sort_by_cached_key(|name, _| outputs.get_index_of(name));
    }
}

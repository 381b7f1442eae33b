//! The experiment file as types, with every default filled in.
//!
//! Reading one is [`ExperimentConfig::from_json`]: strict, and it reports every
//! problem of a file at once. Serialising one gives the *canonical form*: all
//! keys present in a fixed order, and itself a valid experiment file that reads
//! back to an equal value. Workers get it, digests hash it.
//!
//! Lengths are centimetres, times environment steps, angles radians, unless a
//! field says otherwise.

mod algorithm;
mod check;
mod equipment;
pub mod limits;
mod problem;
mod query;
mod read;
mod robot;
mod schema;
mod topology;
mod world;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::json;

pub use algorithm::*;
pub use equipment::*;
pub use problem::{ConfigError, Problem};
pub use query::*;
pub use read::suggestion;
pub use robot::*;
pub use schema::json_schema;
pub use topology::*;
pub use world::*;

/// Maps whose order carries meaning (order of inputs, of segments, of robots).
pub type NamedMap<T> = indexmap::IndexMap<String, T>;

/// A whole experiment: network, evolution, world.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("name, seed"),
    transform = schema::property("$schema", json!({"type": "string"})),
    transform = schema::property("checkpoint_file", json!({"type": ["string", "null"]})),
    transform = schema::ignored("num_processes, render")
)]
pub struct ExperimentConfig {
    /// Name for display; does not influence the run.
    pub name: String,
    /// Master seed of all randomness.
    #[schemars(extend("default" = 0))]
    pub seed: u64,
    /// The neural network's structure.
    pub topology: TopologyConfig,
    /// What evolves, how, and how it is judged.
    pub algorithm: AlgorithmConfig,
    /// Arena, robots, lights, ground areas.
    pub world: WorldConfig,
}

impl ExperimentConfig {
    /// Reads an experiment file. Returns the configuration and the warnings
    /// (keys that are accepted and ignored), or every problem of the file.
    /// `default_name` names an experiment whose file gives no name.
    pub fn from_json(text: &str, default_name: &str) -> Result<(Self, Vec<Problem>), ConfigError> {
        read::read(text, default_name)
    }

    /// The swarms with their names, in the order that numbers the robots.
    pub fn robots(&self) -> impl Iterator<Item = (&str, &RobotConfig)> {
        self.world.objects.iter().filter_map(|(name, object)| match object {
            ObjectConfig::Robot(robot) => Some((name.as_str(), robot)),
            _ => None,
        })
    }

    /// The canonical form, as compact JSON.
    pub fn to_canonical_json(&self) -> String {
        serde_json::to_string(self).expect("plain data with string keys serialises")
    }
}

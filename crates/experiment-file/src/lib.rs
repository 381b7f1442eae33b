//! The types of the experiment file, with every default filled in.
//!
//! [`ExperimentConfig::from_json`] reads a file strictly, and reports all of its problems at once:
//!
//! ```
//! use evolution::ALGORITHMS;
//! use experiment_file::ExperimentConfig;
//!
//! let text = r#"{
//!   "topology": {
//!     "stimuli": {"light": {"n": 4, "sensor": "light_sensor"}},
//!     "ensembles": {"H": {"n": 5}, "OUT": {"n": 2, "activation": "tanh"}},
//!     "synapses": {"in": {"pre": "light", "post": "H"}, "out": {"pre": "H", "post": "OUT"}},
//!     "outputs": {"wheels": {"ensemble": "OUT", "actuator": "wheel_actuator"}},
//!     "decoding": {"wheels": {"scheme": "IdentityDecoding"}}
//!   },
//!   "algorithm": {
//!     "name": "SNES", "evolvable_object": "robot", "fitness_function": "goto_light",
//!     "population_size": 20, "generations": 10, "evaluation_steps": 200, "num_evaluations": 2,
//!     "populations": {
//!       "all": {"objects": ["synapses:weights:all"], "min_vals": -3, "max_vals": 3}
//!     }
//!   },
//!   "world": {"objects": {
//!     "robot": {
//!       "type": "robot", "num_instances": 5, "controller": "neural_controller",
//!       "sensors": {"light_sensor": {"n_sectors": 4}}, "actuators": {"wheel_actuator": {}},
//!       "initializers": {"positions": {"name": "random_uniform"}}
//!     },
//!     "lamp": {
//!       "type": "light_source", "num_instances": 1, "controller": null,
//!       "initializers": {"positions": {"name": "fixed", "params": {"values": [[500, 500]]}}}
//!     }
//!   }}
//! }"#;
//! let (config, warnings) = ExperimentConfig::from_json(text, "example", ALGORITHMS)?;
//! assert_eq!((config.name.as_str(), config.topology.ensembles["H"].n), ("example", 5));
//! assert!(warnings.is_empty());
//!
//! // Two mistakes, two problems, each with its line and its path.
//! let wrong = text.replace(r#""pre": "light""#, r#""pre": "night""#).replace(": 10", ": -10");
//! let error = ExperimentConfig::from_json(&wrong, "example", ALGORITHMS).unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "line 5: topology.synapses.in.pre: no ensemble or stimulus is named `night`; \
//!      did you mean `light`?\n\
//!      line 11: algorithm.generations: must be between 1 and 10000000, is -10"
//! );
//! # Ok::<(), experiment_file::ConfigError>(())
//! ```
//!
//! Serialising an [`ExperimentConfig`] gives its *canonical form*: all keys present in a fixed
//! order, and itself a valid experiment file that reads back to an equal value. Workers get the
//! canonical form, and digests hash it. It omits keys that are newer than the format if they have
//! their defaults, so that older files keep their digests.
//!
//! Lengths are centimetres, times environment steps, angles radians, unless a
//! field says otherwise.
//!
//! `read` turns text into values, `check` compares the values with each other, and both write
//! problems to a `report`. `schema` describes the same format for editors.

mod actuators;
mod aim;
mod algorithm;
mod bodies;
mod check;
mod description;
mod descriptor;
mod encoding;
mod fitness;
mod geometry;
mod learning;
pub mod limits;
mod neuron;
mod node;
mod parameters;
mod platform;
mod problem;
mod query;
mod read;
mod reality;
mod report;
mod robot;
mod schema;
mod seed;
mod semantics;
mod sensors;
mod synapses;
mod task;
mod topology;
mod variant;
mod world;

pub use actuators::*;
pub use aim::*;
pub use algorithm::*;
pub use bodies::*;
pub use description::{AlgorithmDescription, Keeps, LearnsFrom};
pub use descriptor::*;
pub use encoding::*;
pub use fitness::*;
pub use learning::*;
pub use neuron::*;
pub use parameters::{
    DefaultValue, Domain, Kind, Kinds, Nested, Parameter, ParameterValue, Parameters, Params,
    Table, Variants,
};
pub use platform::{Fact, PLATFORMS, Platform};
pub use problem::{ConfigError, Problem};
pub use query::*;
pub use read::plain;
pub use reality::*;
pub use report::suggestion;
pub use robot::*;
pub use schema::{Allowed, Alternative, KeyFacts, UnknownKey, explain_key, json_schema};
use schemars::JsonSchema;
pub use seed::Seed;
pub use sensors::*;
use serde::Serialize;
pub use synapses::*;
pub use task::*;
pub use topology::*;
pub use world::*;

use read::Algorithms;
use report::Report;

/// A map whose order matters, because it numbers inputs, genes or robots.
pub type NamedMap<T> = indexmap::IndexMap<String, T>;

/// A whole experiment: network, evolution, world.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("name, seed, task"),
    transform = schema::property("$schema", schema::place_of_schema()),
    transform = schema::property("semantics", schema::semantics()),
    transform = schema::property("checkpoint_file", schema::checkpoint_file()),
    transform = schema::ignored("num_processes, render")
)]
pub struct ExperimentConfig {
    /// Name of the experiment, which changes no result; default the file's name.
    pub name: String,
    /// Master seed of all randomness.
    #[schemars(schema_with = "schema::seed", extend("default" = 0))]
    pub seed: u64,
    /// The network that every robot has a copy of.
    pub topology: TopologyConfig,
    /// What evolves, by which method, and for which goal.
    pub algorithm: AlgorithmConfig,
    /// The arena with its robots, lights and ground areas.
    pub world: WorldConfig,
    /// A task of your own, as a script.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "TaskConfig")]
    pub task: Option<TaskConfig>,
}

impl ExperimentConfig {
    /// Reads an experiment file. Returns the configuration and the warnings (such as keys that
    /// are accepted and ignored). `default_name` names an experiment whose file gives no name.
    /// `algorithms`: the algorithms that the file may name, usually `evolution::ALGORITHMS`.
    ///
    /// # Errors
    ///
    /// Every problem of the file, each with its place.
    pub fn from_json(
        text: &str,
        default_name: &str,
        algorithms: &'static [AlgorithmDescription],
    ) -> Result<(Self, Vec<Problem>), ConfigError> {
        Self::read(text, default_name, Algorithms::Described(algorithms))
    }

    /// Reads a canonical form, for programs that only simulate. It checks the text like any file,
    /// except the algorithm's name and parameters, which it keeps unchanged.
    ///
    /// # Errors
    ///
    /// Every problem of the text, each with its place.
    pub fn from_canonical_json(text: &str) -> Result<Self, ConfigError> {
        Self::read(text, "", Algorithms::Unchecked).map(|(config, _)| config)
    }

    fn read(
        text: &str,
        default_name: &str,
        algorithms: Algorithms,
    ) -> Result<(Self, Vec<Problem>), ConfigError> {
        // RFC 8259 lets readers ignore a byte order mark, and some editors write one.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let text = &plain(text);
        let root = read::parse(text)?;
        let report = Report::new(text, &root);
        let config = read::read(&report, &root, default_name, algorithms);
        if report.is_complete() {
            check::check(&config, algorithms.find(&config.algorithm.name), &report);
        }
        let warnings = report.finish()?;
        Ok((config, warnings))
    }

    /// The swarms with their names, in the order of the robots' numbers.
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

//! Plasticity: weights that change while robots live.

use schemars::JsonSchema;
use serde::Serialize;

use super::{limits, schema};

/// How weights change while robots live: before every environment step but the first, each
/// weight of a plastic group grows by `learning_rate` R (A x_i x_j + B x_i + C x_j + D), and is
/// then cut to `max_weight`. x are the activities of the postsynaptic neuron i and the
/// presynaptic side j in the step before: u of rate neurons, the share of substeps with a
/// spike of what spikes, the value of a stimulus. R is 1 without `reward`. A group has
/// coefficients of its own, which can evolve (`learning:coefficients`).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    deny_unknown_fields,
    transform = schema::optional("learning_rate, max_weight, A, B, C, D, synapses, reward")
)]
pub struct LearningConfig {
    /// Factor of all changes; default 0.0001.
    #[schemars(range(min = 0, max = 1), extend("default" = 1e-4))]
    pub learning_rate: f64,
    /// Largest absolute value of a plastic weight; default 10, of spiking neurons 1000.
    #[schemars(range(min = 0, max = limits::PLASTIC_WEIGHT))]
    pub max_weight: f64,
    /// A of groups whose coefficients do not evolve; default 1.
    #[serde(rename = "A")]
    #[schemars(
        range(min = -limits::COEFFICIENT, max = limits::COEFFICIENT),
        extend("default" = 1)
    )]
    pub a: f64,
    /// B, likewise; default 0.
    #[serde(rename = "B")]
    #[schemars(
        range(min = -limits::COEFFICIENT, max = limits::COEFFICIENT),
        extend("default" = 0)
    )]
    pub b: f64,
    /// C, likewise; default 0.
    #[serde(rename = "C")]
    #[schemars(
        range(min = -limits::COEFFICIENT, max = limits::COEFFICIENT),
        extend("default" = 0)
    )]
    pub c: f64,
    /// D, likewise; default 0.
    #[serde(rename = "D")]
    #[schemars(
        range(min = -limits::COEFFICIENT, max = limits::COEFFICIENT),
        extend("default" = 0)
    )]
    pub d: f64,
    /// Names of the plastic groups; default all.
    #[schemars(schema_with = "schema::names")]
    pub synapses: Vec<String>,
    /// Makes changes depend on reward; default null: they do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reward: Option<RewardConfig>,
}

/// How reward changes weights: x are those of `delay` steps ago, and R is the sum of the
/// rewards since then, r + discount r' + discount^2 r'' + ... A reward is the fitness of a step,
/// 0 where it does not count.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::optional("delay, discount"))]
pub struct RewardConfig {
    /// Environment steps; default 30.
    #[schemars(range(min = 1, max = limits::REWARD_DELAY), extend("default" = 30))]
    pub delay: u32,
    /// Factor of each reward against the one before; default 0.9.
    #[schemars(range(min = 0, max = 1), extend("default" = 0.9))]
    pub discount: f64,
}

impl LearningConfig {
    /// A, B, C and D of a group whose coefficients do not evolve.
    pub fn coefficients(&self) -> [f64; 4] {
        [self.a, self.b, self.c, self.d]
    }
}

//! `script_sensor`: what the function `sense` of a script says.

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::limits;
use crate::node::{Node, Object};
use crate::semantics::Semantics;

/// Numbers that the function `sense` of the script of `task` returns for a robot.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct ScriptSensorConfig {
    /// Numbers that the function returns.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n: u32,
    /// Smaller numbers become this one; default 0.
    #[schemars(default = "least")]
    pub low: f64,
    /// Larger numbers become this one; default 1.
    #[schemars(default = "greatest")]
    pub high: f64,
}

fn least() -> f64 {
    0.0
}

fn greatest() -> f64 {
    1.0
}

impl SensorConfig for ScriptSensorConfig {
    fn read(o: &mut Object<'_>, _: Semantics) -> Self {
        Self {
            n: o.required("n").u32(1..=limits::SECTORS),
            low: o.or("low", least(), Node::quantity),
            high: o.or("high", greatest(), Node::quantity),
        }
    }

    /// A script may look at everything for each of its numbers.
    fn n_sectors(&self) -> u32 {
        self.n
    }
}

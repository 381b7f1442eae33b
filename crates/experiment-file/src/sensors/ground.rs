//! `ground_sensor`: whether the robot stands on an area of a colour.

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::node::{Node, Object};
use crate::semantics::Semantics;

/// Ground sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub struct GroundSensorConfig {
    /// Colour it sees; default "black".
    pub color: String,
}

impl Default for GroundSensorConfig {
    fn default() -> Self {
        Self { color: "black".to_owned() }
    }
}

impl SensorConfig for GroundSensorConfig {
    fn read(o: &mut Object<'_>, _: Semantics) -> Self {
        let default = Self::default();
        Self { color: o.or("color", default.color, Node::name) }
    }
}

//! Sensors that have nothing to configure: `own_position_sensor`, `own_orientation_sensor`,
//! `food_sensor`, `food_area_sensor`, `nest_sensor`.

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::node::Object;
use crate::schema;
use crate::semantics::Semantics;

/// A sensor without parameters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(deny_unknown_fields, transform = schema::ignored("range, noise_sigma"))]
pub struct PlainSensorConfig {}

impl SensorConfig for PlainSensorConfig {
    fn read(o: &mut Object<'_>, _: Semantics) -> Self {
        for key in ["range", "noise_sigma"] {
            o.ignored(key, "such a sensor has neither reach nor noise");
        }
        Self {}
    }
}

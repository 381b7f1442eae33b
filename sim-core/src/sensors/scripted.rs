//! Script sensor: the result of the function `sense` of the task's script.

use std::ops::RangeInclusive;

use super::{Sensor, Surroundings, Viewpoint};
use crate::world::World;
use experiment_file::ScriptSensorConfig;

pub(super) fn script_sensor(config: &ScriptSensorConfig, _: &World) -> ScriptSensorConfig {
    config.clone()
}

/// The script fills in the readings after all other sensors, and draws their noise itself.
impl Sensor for ScriptSensorConfig {
    fn value_range(&self) -> RangeInclusive<f64> {
        self.low..=self.high
    }

    /// The previous reading stays until the script has computed the new one.
    fn sense(&self, _: Viewpoint, _: &Surroundings<'_>, _: &mut [f64]) {}
}

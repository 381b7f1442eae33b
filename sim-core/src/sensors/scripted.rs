//! Script sensor: what the function `sense` of the task's script says.

use std::ops::RangeInclusive;

use super::{Sensor, Surroundings, Viewpoint};
use crate::world::World;
use experiment_file::ScriptSensorConfig;

pub(super) fn script_sensor(config: &ScriptSensorConfig, _: &World) -> ScriptSensorConfig {
    config.clone()
}

/// The script fills in the readings, after all other sensors have sensed, and draws its noise.
impl Sensor for ScriptSensorConfig {
    fn value_range(&self) -> RangeInclusive<f64> {
        self.low..=self.high
    }

    /// The reading of the step before stays until the script has said the new one.
    fn sense(&self, _: Viewpoint, _: &Surroundings<'_>, _: &mut [f64]) {}
}

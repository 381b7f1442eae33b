//! Script sensor: what the function `sense` of the task's script says.

use std::ops::RangeInclusive;

use super::{Noise, Sensor, Surroundings, Viewpoint};
use experiment_file::ScriptSensorConfig;

/// A sensor whose readings the script fills in, after all other sensors have sensed.
#[derive(Debug, Clone)]
pub(crate) struct ScriptSensor {
    n_values: usize,
    low: f64,
    high: f64,
}

impl ScriptSensor {
    /// As configured.
    pub fn new(config: &ScriptSensorConfig) -> Self {
        let &ScriptSensorConfig { n, low, high } = config;
        Self { n_values: n as usize, low, high }
    }
}

impl Sensor for ScriptSensor {
    fn reading_len(&self) -> usize {
        self.n_values
    }

    fn value_range(&self) -> RangeInclusive<f64> {
        self.low..=self.high
    }

    /// The script draws its own.
    fn noise(&self) -> Noise {
        Noise::NONE
    }

    /// The reading of the step before stays until the script has said the new one.
    fn sense(&self, _: Viewpoint, _: &Surroundings<'_>, _: &mut [f64]) {}
}

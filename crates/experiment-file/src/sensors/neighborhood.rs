//! `neighborhood_pos_sensor`: where the nearest robots are and look.

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::node::Object;
use crate::semantics::Semantics;
use crate::{limits, schema};

/// Absolute positions and headings of the nearest robots.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::ignored("range, noise_sigma")
)]
pub struct NeighborhoodSensorConfig {
    /// Robots in a reading, the nearest first; default 1.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_neighbors: u32,
}

impl Default for NeighborhoodSensorConfig {
    fn default() -> Self {
        Self { n_neighbors: 1 }
    }
}

impl SensorConfig for NeighborhoodSensorConfig {
    fn read(o: &mut Object<'_>, _: Semantics) -> Self {
        for key in ["range", "noise_sigma"] {
            o.ignored(key, "the sensor knows all robots, without noise");
        }
        let default = Self::default();
        Self { n_neighbors: o.or("n_neighbors", default.n_neighbors, super::sectors) }
    }

    fn n_sectors(&self) -> u32 {
        self.n_neighbors
    }
}

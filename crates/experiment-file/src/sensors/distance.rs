//! `distance_sensor`: how near other robots are, per sector.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::node::{Node, Object};
use crate::semantics::Semantics;
use crate::{limits, schema};

/// Distance sensor.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    default,
    deny_unknown_fields,
    transform = schema::property("noise_sigma", schema::amount("Its square is `noise_variance`."))
)]
pub struct DistanceSensorConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 60.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Decay per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
    /// Variance of the Gaussian noise; default 0.1.
    #[schemars(range(min = 0))]
    pub noise_variance: f64,
    /// Largest angle between a sector's direction and what it sees, radians; default
    /// pi: every sector sees everything.
    #[serde(skip_serializing_if = "super::is_all_around")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = PI))]
    pub aperture: f64,
}

impl Default for DistanceSensorConfig {
    fn default() -> Self {
        Self {
            n_sectors: 4,
            range: 60.0,
            decay_rho: 0.05,
            decay_phi: 1.0,
            noise_variance: 0.1,
            aperture: PI,
        }
    }
}

impl SensorConfig for DistanceSensorConfig {
    fn read(o: &mut Object<'_>, semantics: Semantics) -> Self {
        let default: Self = semantics.defaults();
        let n_sectors = o.or("n_sectors", default.n_sectors, super::sectors);
        let aperture = semantics.distance_aperture(n_sectors).min(PI);
        Self {
            n_sectors,
            range: o.or("range", default.range, Node::positive),
            decay_rho: o.or("decay_rho", default.decay_rho, Node::amount),
            decay_phi: o.or("decay_phi", default.decay_phi, Node::amount),
            noise_variance: super::noise_variance(o, default.noise_variance),
            aperture: o.or("aperture", aperture, super::aperture),
        }
    }

    fn n_sectors(&self) -> u32 {
        self.n_sectors
    }
}

//! `wireless_receiver`: frames of other robots.

use schemars::JsonSchema;
use serde::Serialize;

use super::SensorConfig;
use crate::node::{Node, Object};
use crate::{limits, schema};

/// Receiver of the wireless link (section 3.3).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(default, deny_unknown_fields, transform = schema::ignored("noise_sigma"))]
pub struct WirelessReceiverConfig {
    /// Sectors; default 4.
    #[schemars(range(min = 1, max = limits::SECTORS))]
    pub n_sectors: u32,
    /// Reach, cm; default 100.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub range: f64,
    /// Components of a message, M; default 2.
    #[schemars(range(min = 1, max = limits::MESSAGE_LENGTH))]
    pub msg_length: u32,
    /// A frame of this many hops is not accepted any more; default 10.
    #[schemars(range(min = 1, max = limits::HOPS))]
    pub max_hops: u32,
    /// Decay of the strength per cm; default 0.05.
    #[schemars(range(min = 0))]
    pub decay_rho: f64,
    /// Decay of the strength per radian; default 1.
    #[schemars(range(min = 0))]
    pub decay_phi: f64,
}

impl Default for WirelessReceiverConfig {
    fn default() -> Self {
        Self {
            n_sectors: 4,
            range: 100.0,
            msg_length: 2,
            max_hops: 10,
            decay_rho: 0.05,
            decay_phi: 1.0,
        }
    }
}

impl SensorConfig for WirelessReceiverConfig {
    fn read(o: &mut Object<'_>) -> Self {
        let default = Self::default();
        o.ignored("noise_sigma", "reception has no noise");
        Self {
            n_sectors: o.or("n_sectors", default.n_sectors, super::sectors),
            range: o.or("range", default.range, Node::positive),
            msg_length: o
                .or("msg_length", default.msg_length, |node| node.u32(1..=limits::MESSAGE_LENGTH)),
            max_hops: o.or("max_hops", default.max_hops, |node| node.u32(1..=limits::HOPS)),
            decay_rho: o.or("decay_rho", default.decay_rho, Node::amount),
            decay_phi: o.or("decay_phi", default.decay_phi, Node::amount),
        }
    }

    fn n_sectors(&self) -> u32 {
        self.n_sectors
    }
}

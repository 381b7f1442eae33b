//! `wireless_receiver`: frames of other robots.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::SensorConfig;
use crate::node::{Node, Object};
use crate::semantics::Semantics;
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
    /// Whose sector the sending direction is; default `emitter`.
    #[serde(skip_serializing_if = "SendingDirection::is_default")]
    pub sending_direction: SendingDirection,
}

/// Of which robot the reading `wireless_receiver:sending_direction` gives the sector.
/// The two differ for frames that were relayed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SendingDirection {
    /// The robot that is heard: its sector that faces the listener (section 3.3.2).
    #[default]
    Emitter,
    /// The robot whose message it is: its sector that faced the first robot to hear
    /// the message.
    Originator,
}

impl SendingDirection {
    /// Whether the canonical form leaves it out.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
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
            sending_direction: SendingDirection::default(),
        }
    }
}

impl SensorConfig for WirelessReceiverConfig {
    fn read(o: &mut Object<'_>, semantics: Semantics) -> Self {
        let default: Self = semantics.defaults();
        o.ignored("noise_sigma", "reception has no noise");
        Self {
            n_sectors: o.or("n_sectors", default.n_sectors, super::sectors),
            range: o.or("range", default.range, Node::positive),
            msg_length: o
                .or("msg_length", default.msg_length, |node| node.u32(1..=limits::MESSAGE_LENGTH)),
            max_hops: o.or("max_hops", default.max_hops, |node| node.u32(1..=limits::HOPS)),
            decay_rho: o.or("decay_rho", default.decay_rho, Node::amount),
            decay_phi: o.or("decay_phi", default.decay_phi, Node::amount),
            sending_direction: o.or("sending_direction", default.sending_direction, |node| {
                node.variant(&[]).unwrap_or_default()
            }),
        }
    }

    fn n_sectors(&self) -> u32 {
        self.n_sectors
    }
}

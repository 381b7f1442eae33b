//! What a robot's radio can do.

use crate::sensors::Decay;
use crate::torus::{Vec2, sector_angle};
use experiment_file::SendingDirection;

/// The properties of a robot's receiver and transmitter.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Antenna {
    /// Reach of the transmitter, cm; `None`: the robot does not emit.
    pub emits_within: Option<f64>,
    /// The receiver; `None`: the robot does not listen.
    pub receiver: Option<Receiver>,
}

impl Antenna {
    /// Distance within which others hear the robot, cm; negative if it does not emit.
    pub fn reach(&self) -> f64 {
        self.emits_within.unwrap_or(-1.0)
    }

    /// Multiplies the reaches of receiver and transmitter by a factor.
    pub fn scale(&mut self, factor: f64) {
        if let Some(reach) = &mut self.emits_within {
            *reach *= factor;
        }
        if let Some(receiver) = &mut self.receiver {
            receiver.range *= factor;
        }
    }
}

/// The properties of a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Receiver {
    /// Sectors, n.
    pub n_sectors: usize,
    /// Reach, cm.
    pub range: f64,
    /// Fading of the strength.
    pub decay: Decay,
    /// Frames with this many hops are not accepted.
    pub max_hops: u32,
    /// The robot whose sector is the sending direction.
    pub sending_direction: SendingDirection,
    /// Whether to compute sending directions: only some networks get them.
    pub observes_sending_direction: bool,
}

impl Receiver {
    /// (cos, sin) of each sector in its robot's own frame of reference.
    pub fn directions(&self) -> impl Iterator<Item = Vec2> + use<> {
        let n_sectors = self.n_sectors;
        (0..n_sectors).map(move |sector| Vec2::unit(sector_angle(sector, n_sectors)))
    }
}

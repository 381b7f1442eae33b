//! The frames on the air, one per robot.

use crate::torus::Vec2;

/// The origin of a frame's message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameOrigin {
    /// The robot that sent the message first.
    pub originator: usize,
    /// Number of emissions so far, at least 1.
    pub hops: u32,
    /// Direction in which the originator sent the message, in the originator's own frame of
    /// reference. The first relaying robot observes it; on the first hop, it is zero (none).
    pub sending_direction: Vec2,
}

impl FrameOrigin {
    /// The origin of a frame from a robot that had nothing to relay: it has more hops than any
    /// receiver accepts.
    pub const NOTHING: Self =
        Self { originator: usize::MAX, hops: u32::MAX, sending_direction: Vec2::new(0.0, 0.0) };

    /// The origin of a robot's own message.
    pub fn sent_by(originator: usize) -> Self {
        Self { originator, hops: 1, sending_direction: Vec2::default() }
    }
}

/// All frames on the air. Frame r belongs to robot r. To receivers, a missing frame looks like
/// one with the origin [`FrameOrigin::NOTHING`].
#[derive(Debug, Clone)]
pub(crate) struct Ether {
    /// Origins of all robots' frames, and then of a missing frame.
    origins: Vec<FrameOrigin>,
    /// `[robot][component]`
    messages: Vec<f64>,
    message_len: usize,
}

impl Ether {
    /// An ether without frames.
    pub fn new(n_robots: usize, message_len: usize) -> Self {
        Self {
            origins: vec![FrameOrigin::NOTHING; n_robots + 1],
            messages: vec![0.0; n_robots * message_len],
            message_len,
        }
    }

    /// Components of a message.
    pub fn message_len(&self) -> usize {
        self.message_len
    }

    /// The origin of a robot's frame; `NOTHING` for the number after the last robot.
    pub fn origin(&self, emitter: usize) -> FrameOrigin {
        self.origins[emitter]
    }

    /// Whether a receiver that accepts fewer than `max_hops` hops accepts a robot's frame, which
    /// may be missing.
    pub fn is_valid(&self, emitter: usize, receiver: usize, max_hops: u32) -> bool {
        let FrameOrigin { originator, hops, .. } = self.origins[emitter];
        (originator != receiver) & (hops < max_hops)
    }

    /// Message of a robot's frame.
    pub fn message(&self, emitter: usize) -> &[f64] {
        &self.messages[emitter * self.message_len..][..self.message_len]
    }

    /// Puts a robot's frame on the air, in place of its previous frame.
    pub fn emit(&mut self, emitter: usize, origin: FrameOrigin, message: &[f64]) {
        self.origins[emitter] = origin;
        self.messages[emitter * self.message_len..][..self.message_len].copy_from_slice(message);
    }
}

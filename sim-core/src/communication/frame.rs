//! The frames on the air, one per robot.

use crate::torus::Vec2;

/// Where a frame's message comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameOrigin {
    /// The robot whose message it is.
    pub originator: usize,
    /// Emissions so far, from 1.
    pub hops: u32,
    /// In which direction the originator sent it, in the originator's own frame,
    /// as the first relaying robot observed it; zero (none) on the first hop.
    pub sending_direction: Vec2,
}

impl FrameOrigin {
    /// Of a frame that a robot emitted which had nothing to relay: it has made more hops than
    /// any receiver accepts.
    pub const NOTHING: Self =
        Self { originator: usize::MAX, hops: u32::MAX, sending_direction: Vec2::new(0.0, 0.0) };

    /// Of a robot's own message.
    pub fn sent_by(originator: usize) -> Self {
        Self { originator, hops: 1, sending_direction: Vec2::default() }
    }
}

/// All frames on the air. Frame r is robot r's. Where there is none, it is the same for
/// receivers as one that comes from nothing.
#[derive(Debug, Clone)]
pub(crate) struct Ether {
    /// Of each robot's frame; and of the frame of nobody, who has the number after theirs.
    origins: Vec<FrameOrigin>,
    /// `[robot][component]`
    messages: Vec<f64>,
    message_len: usize,
}

impl Ether {
    /// No frame is on the air.
    pub fn new(n_robots: usize, message_len: usize) -> Self {
        Self {
            origins: vec![FrameOrigin::NOTHING; n_robots + 1],
            messages: vec![0.0; n_robots * message_len],
            message_len,
        }
    }

    /// Where a robot's frame comes from; nobody's comes from nothing.
    pub fn origin(&self, emitter: usize) -> FrameOrigin {
        self.origins[emitter]
    }

    /// Whether a robot that accepts less than `max_hops` hops takes the frame of another one,
    /// or of nobody.
    pub fn is_valid(&self, emitter: usize, receiver: usize, max_hops: u32) -> bool {
        let FrameOrigin { originator, hops, .. } = self.origins[emitter];
        (originator != receiver) & (hops < max_hops)
    }

    /// Message of a robot's frame.
    pub fn message(&self, emitter: usize) -> &[f64] {
        &self.messages[emitter * self.message_len..][..self.message_len]
    }

    /// Puts a robot's frame on the air, in place of its last one.
    pub fn emit(&mut self, emitter: usize, origin: FrameOrigin, message: &[f64]) {
        self.origins[emitter] = origin;
        self.messages[emitter * self.message_len..][..self.message_len].copy_from_slice(message);
    }
}

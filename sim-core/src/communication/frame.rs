//! The frames on the air, one per robot.

use crate::torus::Vec2;

/// Where a frame's message comes from. A frame without an origin is one that a
/// robot emitted which had nothing to relay: no receiver accepts it.
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
    /// Of a robot's own message.
    pub fn sent_by(originator: usize) -> Self {
        Self { originator, hops: 1, sending_direction: Vec2::default() }
    }
}

/// All frames on the air. Frame r is robot r's. Where there is none, it is the same for
/// receivers as a frame without origin.
#[derive(Debug, Clone)]
pub(crate) struct Ether {
    origins: Vec<Option<FrameOrigin>>,
    /// `[robot][component]`
    messages: Vec<f64>,
    message_len: usize,
}

impl Ether {
    /// No frame is on the air.
    pub fn new(n_robots: usize, message_len: usize) -> Self {
        Self {
            origins: vec![None; n_robots],
            messages: vec![0.0; n_robots * message_len],
            message_len,
        }
    }

    /// FrameOrigin of a robot's frame.
    pub fn origin(&self, emitter: usize) -> Option<&FrameOrigin> {
        self.origins[emitter].as_ref()
    }

    /// Message of a robot's frame.
    pub fn message(&self, emitter: usize) -> &[f64] {
        &self.messages[emitter * self.message_len..][..self.message_len]
    }

    /// Puts a robot's frame on the air, in place of its last one.
    pub fn emit(&mut self, emitter: usize, origin: Option<FrameOrigin>, message: &[f64]) {
        self.origins[emitter] = origin;
        self.messages[emitter * self.message_len..][..self.message_len].copy_from_slice(message);
    }
}

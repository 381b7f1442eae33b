//! The wireless link between robots (section 3.3 of the thesis).

mod antenna;
mod draws;
mod frame;
mod hearing;
mod quantisation;
mod radio;

pub(crate) use antenna::{Antenna, Receiver};
pub(crate) use frame::FrameOrigin;
pub(crate) use quantisation::Quantiser;
pub(crate) use radio::Radio;

use serde::Serialize;

/// The mode of a robot's transmitter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Emits its own message.
    #[default]
    Send,
    /// Relays the frame that it received.
    Relay,
}

//! The wireless link between robots (section 3.3 of the thesis).

mod frame;
mod hearing;
mod quantisation;
mod radio;

pub(crate) use frame::Origin;
pub(crate) use hearing::{Antenna, Receiver};
pub(crate) use quantisation::Quantiser;
pub(crate) use radio::Radio;

/// What a robot does with its transmitter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mode {
    /// Emits its own message.
    #[default]
    Send,
    /// Passes on the frame that it received.
    Relay,
}

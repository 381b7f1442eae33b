//! Numbers with the same bits on every machine.
//!
//! - [`random`]: random streams that are addressed by what they are for;
//! - [`Isa`]: the vector instructions that a computation uses, which decide how
//!   fast it is and change no bit.

mod isa;
pub mod random;

pub use isa::{Isa, UnknownIsa};

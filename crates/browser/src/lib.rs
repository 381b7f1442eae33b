//! The simulator for web pages, as a WebAssembly module: the same crates as in the other programs,
//! so a browser computes the same bits and finds the same flaws.
//!
//! A page needs no generated code. It asks `buffer` for room, writes a message into it (a header in
//! JSON, and bytes), and lets `call` replace the message by the answer. A [`Session`] is what a
//! module remembers between two calls.

#[cfg(target_family = "wasm")]
mod exports;
mod fleet;
mod message;
mod proving;
mod replaying;
mod session;
mod simulating;
#[cfg(test)]
mod tests;

pub use session::Session;

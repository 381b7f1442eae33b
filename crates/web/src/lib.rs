//! Experiments in a browser.
//!
//! - [`replay_file`], [`proof_file`], [`demo_file`]: the player with an episode, a bundle that
//!   proves itself, or a fleet, as one HTML file
//! - [`SIMULATOR`]: the simulator for browsers, from the crate `browser`
//! - [`Site`]: the pages over HTTP, with data from a [`Reader`](model::queries::Reader) and
//!   a [`Control`]
//! - `modules`: the JavaScript and the style, from the folder `pages`
//!
//! The pages are plain HTML, CSS and ES modules, and load nothing from other servers. What needs
//! the database or the fleet, the server decides; episodes, proofs and the demo run in the page.

mod modules;
mod server;
mod single_file;
mod source;

pub use server::Site;
pub use single_file::{demo_file, proof_file, replay_file};
pub use source::{Action, Control};

/// The WebAssembly module of the crate `browser`, packed by gzip. None in programs that were
/// compiled without it.
pub const SIMULATOR: Option<&[u8]> =
    if SIMULATOR_FILE.is_empty() { None } else { Some(SIMULATOR_FILE) };

const SIMULATOR_FILE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/simulator.wasm.gz"));

//! Experiments in a browser: pages, and the replay of episodes.
//!
//! - [`Replay`]: an episode, simulated again and packed for the player
//! - [`Trials`]: the trials of an individual, one of which a replay shows
//! - [`replay_file`], [`proof_file`]: the player with an episode, or a bundle that proves itself,
//!   as one HTML file
//! - [`SIMULATOR`]: the simulator for browsers, from the crate `browser`
//! - [`Site`]: the pages over HTTP, with data from a [`Reader`](model::queries::Reader) and
//!   a [`Control`]
//! - `modules`: the JavaScript and the style, from the folder `pages`
//!
//! The pages are plain HTML, CSS and ES modules. They load nothing from other servers, and
//! the server makes all decisions.

mod modules;
mod replay;
mod server;
mod single_file;
mod source;
mod trials;
mod what_if;

pub use replay::{Episode, Replay, ReplayError};
pub use server::Site;
pub use single_file::{proof_file, replay_file};
pub use source::{Action, Assignment, Control, Fate};
pub use trials::Trials;

/// The WebAssembly module of the crate `browser`, packed by gzip. None in programs that were compiled
/// without it.
pub const SIMULATOR: Option<&[u8]> =
    if SIMULATOR_FILE.is_empty() { None } else { Some(SIMULATOR_FILE) };

const SIMULATOR_FILE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/simulator.wasm.gz"));

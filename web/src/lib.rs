//! What people see of experiments in a browser: pages, and the replay of episodes.
//!
//! - [`Replay`]: an episode, simulated again and packed for the player
//! - [`Trials`]: the trials of which a replay shows one
//! - [`replay_file`]: the player with an episode, as one HTML file
//! - [`Site`]: the pages over HTTP, made of what a [`Reader`](model::queries::Reader) and a
//!   [`Control`] say
//! - `modules`: the JavaScript and the style, from the folder `pages`
//!
//! The pages are plain HTML, CSS and ES modules. They load nothing from elsewhere, and
//! everything that decides is on this side of the wire.

mod modules;
mod replay;
mod replay_file;
mod server;
mod source;
mod trials;
mod what_if;

pub use replay::{Episode, Replay, ReplayError};
pub use replay_file::replay_file;
pub use server::Site;
pub use source::{Action, Assignment, Control, Fate};
pub use trials::Trials;

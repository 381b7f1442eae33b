//! Experiments in a browser: pages, and the replay of episodes.
//!
//! - [`Replay`]: an episode, simulated again and packed for the player
//! - [`Trials`]: the trials of an individual, one of which a replay shows
//! - [`replay_file`]: the player with an episode, as one HTML file
//! - [`Site`]: the pages over HTTP, with data from a [`Reader`](model::queries::Reader) and
//!   a [`Control`]
//! - `modules`: the JavaScript and the style, from the folder `pages`
//!
//! The pages are plain HTML, CSS and ES modules. They load nothing from other servers, and
//! the server makes all decisions.

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

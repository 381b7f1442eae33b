//! What needs a coordinator or workers in this process: `run`, and whatever works on a data
//! directory. `without_local.rs` is in its place where they are left out.

pub mod fleet;
pub mod services;

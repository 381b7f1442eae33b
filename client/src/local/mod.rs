//! The coordinator and workers in this process, for `run` and for commands on a data
//! directory. A build without them has `without_local.rs` instead.

pub mod fleet;
pub mod services;

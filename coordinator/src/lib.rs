//! The coordinator: owns every experiment's evolution, hands genotypes to
//! workers, keeps every completed generation.
//!
//! - the crate `evolution`: which genotypes to evaluate next (pure)
//! - the crate `model`: the database, and what can be read of it
//! - [`engine`]: which worker computes what (pure, synchronous)
//! - `runs`: what an experiment does next, from its submission to its end (pure,
//!   synchronous)
//! - `driver`: the loop that carries out what engine and runs decide
//! - `control`: what clients can have a running coordinator do
//! - `rpc`: gRPC services, which only translate
//! - `server`: listening, TLS, tokens, limits on connections and calls
//! - [`local`]: experiments that the calling process computes by itself
//! - `health_check`: asks another process's coordinator how it is
//! - [`referee`]: evaluates single items, in a process of its own
//! - [`metrics`]: what can be scraped
//! - `memory`: what an experiment takes of it
//! - [`limits`]: every bound on what the network can ask for
//! - [`program`]: the command line of the program

mod byte_budget;
mod clock;
mod control;
mod driver;
pub mod engine;
mod health_check;
pub mod limits;
pub mod local;
mod memory;
pub mod metrics;
pub mod program;
pub mod referee;
mod rpc;
mod runs;
mod server;

use model::{codec, failpoint, queries, shared_store, submission, text};
/// What the store keeps, and what names it.
pub use model::{group, ids, labels, priority, store};

pub use health_check::{Unhealthy, health_check};
pub use server::{
    Access, AccessError, Coordinator, CoordinatorConfig, Door, InProcess, Role, RunError,
    StartError, Tls, Tokens,
};

//! The coordinator: owns every experiment's evolution, hands genotypes to
//! workers, keeps every completed generation.
//!
//! - the crate `evolution`: which genotypes to evaluate next (pure)
//! - [`engine`]: which worker computes what (pure, synchronous)
//! - [`store`]: SQLite, one transaction per generation
//! - `runs`: what an experiment does next, from its submission to its end (pure,
//!   synchronous)
//! - `driver`: the loop that carries out what engine and runs decide
//! - `control`: what clients can have a running coordinator do
//! - `queries`: what can be read of experiments; works on the store alone
//! - `rpc`: gRPC services, which only translate
//! - `server`: listening, TLS, tokens, limits on connections and calls
//! - [`local`]: experiments that the calling process computes by itself
//! - [`group`]: which experiments belong together
//! - [`labels`]: what people find experiments by
//! - `health_check`: asks another process's coordinator how it is
//! - [`referee`]: evaluates single items, in a process of its own
//! - [`metrics`]: what can be scraped
//! - `memory`: what an experiment takes of it
//! - [`limits`]: every bound on what the network can ask for
//! - [`program`]: the command line of the program

mod clock;
mod codec;
mod control;
mod driver;
pub mod engine;
mod failpoint;
pub mod group;
mod health_check;
pub mod ids;
pub mod labels;
pub mod limits;
pub mod local;
mod memory;
pub mod metrics;
pub mod priority;
pub mod program;
mod queries;
pub mod referee;
mod rpc;
mod runs;
mod server;
mod shared_store;
pub mod store;
mod submission;
mod text;

pub use health_check::{Unhealthy, health_check};
pub use queries::{Address, NotAnAddress, Who};
pub use rpc::PagesArchive;
pub use server::{
    Access, AccessError, BlockingReader, Coordinator, CoordinatorConfig, Door, InProcess, Role,
    RunError, StartError, Tls, Tokens,
};

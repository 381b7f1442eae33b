//! The coordinator: owns every experiment's evolution, sends genotypes to workers, stores every
//! completed generation.
//!
//! - the crate `evolution`: draws the genotypes to evaluate next (pure)
//! - the crate `model`: the database, and the calls that read it
//! - the crate [`engine`]: schedules items on workers (pure, synchronous)
//! - `runs`: the life of an experiment, from its submission to its end (pure, synchronous)
//! - `driver`: the loop that carries out the commands of engine and runs
//! - `control`: the operations that a running coordinator offers to clients
//! - `rpc`: gRPC services, which only translate
//! - `server`: listening, TLS, tokens, limits on connections and calls
//! - [`local`]: experiments that the Python package evolves itself, in a database
//! - `health_check`: asks a coordinator in another process whether it is healthy
//! - [`referee`]: evaluates single items, in a process of its own
//! - [`metrics`]: the values for Prometheus
//! - `memory`: estimates the memory of an experiment
//! - `byte_budget`: the memory that answers and requests share
//! - `clock`: the time that the synchronous parts get
//! - [`limits`]: all bounds on requests from the network
//! - [`program`]: the command line of the program

mod byte_budget;
mod clock;
mod control;
mod driver;
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
/// The store, and the names of its contents.
pub use model::{group, ids, labels, priority, store};

pub use health_check::{Unhealthy, health_check};
pub use server::{
    Access, AccessError, Coordinator, CoordinatorConfig, Door, InProcess, Role, RunError,
    StartError, Tls, Tokens,
};

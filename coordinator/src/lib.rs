//! The coordinator: owns every experiment's evolution, hands genotypes to
//! workers, keeps every completed generation.
//!
//! - [`evolution`]: which genotypes to judge next (pure)
//! - [`engine`]: which worker computes what (pure, synchronous)
//! - [`store`]: SQLite, one transaction per generation
//! - `driver`: the loop that connects the three with the network
//! - `rpc`: gRPC services, translation only

mod clock;
mod driver;
pub mod engine;
pub mod evolution;
pub mod ids;
mod rpc;
mod server;
mod shared_store;
pub mod store;
mod submission;

pub use server::{Coordinator, CoordinatorConfig, StartError};

//! The database of experiments: ids and names, the rows of the database, and the queries that
//! read it. Programs that only read or name experiments need this crate and no coordinator.
//!
//! - [`ids`], [`Address`], [`group`], [`labels`], [`priority`]: names, groups and weights of
//!   experiments and genotypes
//! - [`store`]: SQLite, one transaction per generation; [`shared_store`]: the same for
//!   asynchronous code
//! - [`submission`]: converts an experiment file to a row; [`restored`]: converts a row to
//!   evolution
//! - [`queries`]: the calls that only read, in the messages of clients
//! - [`codec`]: jobs, trial sets and outputs in messages of coordinator and workers
//! - [`wire`]: rows as messages
//! - [`limits`]: bounds on stored data and on answers

mod address;
#[cfg(feature = "messages")]
pub mod codec;
#[cfg(feature = "database")]
pub mod failpoint;
pub mod group;
pub mod ids;
pub mod labels;
pub mod limits;
pub mod priority;
#[cfg(feature = "database")]
pub mod queries;
#[cfg(feature = "database")]
pub mod restored;
#[cfg(feature = "database")]
pub mod shared_store;
#[cfg(feature = "database")]
mod status;
#[cfg(feature = "database")]
pub mod store;
#[cfg(feature = "database")]
pub mod submission;
#[cfg(feature = "database")]
pub mod text;
#[cfg(feature = "database")]
pub mod wire;

pub use address::{Address, Cell, NotAnAddress, Who};

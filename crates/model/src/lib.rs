//! The database of experiments: what names them, the rows of the database, and the queries that
//! read it. Whoever only reads or names experiments needs this crate and no coordinator.
//!
//! - [`ids`], [`Address`], [`group`], [`labels`], [`priority`]: what names, joins and ranks
//!   experiments and genotypes
//! - [`store`]: SQLite, one transaction per generation; [`shared_store`]: the same for
//!   asynchronous code
//! - [`submission`]: from an experiment file to a row; [`restored`]: from a row to evolution
//! - [`queries`]: what can be read of experiments, in the messages of clients
//! - [`codec`]: what coordinator and workers name on the wire
//! - [`wire`]: rows as messages
//! - [`limits`]: bounds on what is kept and answered

mod address;
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

pub use address::{Address, NotAnAddress, Who};

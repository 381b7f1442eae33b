//! The coordinator through its public API: one program, a module for each subject.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod health_check;
mod hostile_clients;
mod hostile_workers;
mod referee;

use std::{net::SocketAddr, path::PathBuf};

use coordinator::{CoordinatorConfig, referee::RefereeProgram};

/// The usual configuration, for a coordinator inside a test program.
fn config(listen: SocketAddr, data_dir: PathBuf) -> CoordinatorConfig {
    let path = env!("CARGO_BIN_EXE_coordinator").into();
    let referee = RefereeProgram { path, args: vec!["referee".into()] };
    CoordinatorConfig { referee, ..CoordinatorConfig::new(listen, data_dir) }
}

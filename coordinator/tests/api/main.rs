//! The coordinator through its public API: one program, a module for each subject.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod engine;
mod health_check;
mod hostile_clients;
mod hostile_workers;
mod referee;
mod simulated_fleet;

//! Whole fleets of real processes: one program, a module for each subject.
//!
//! `cargo test -p fleet-tests --test fleet faults::` runs one subject.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod budgets;
mod bundles;
mod command_line;
mod data_directory;
mod determinism;
mod evaluation;
mod explain;
mod faults;
mod file_kinds;
mod forks;
mod fronts;
mod groups;
mod health;
mod individuals;
mod life;
mod lineage;
mod metrics;
mod monitoring;
mod protocol;
mod python_client;
mod read_out;
mod repertoires;
mod reproduction;
mod scripts;
mod security;
mod settings;
mod simulate;
mod slurm;
mod starved;
mod steering;
mod strangers;
mod terminals;
mod written_files;

//! `swarmctl`: submits experiments to a coordinator, follows them and reads their
//! results; runs an experiment in this process, with its own coordinator and workers;
//! and checks files and simulates trials without a coordinator.

mod args;
mod banner;
mod clock;
mod commands;
mod connection;
mod error;
mod experiment_file;
#[cfg(test)]
mod fake_coordinator;
mod figure;
mod interrupt;
mod json;
mod progress;
mod settings;
mod table;
mod text;

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::Parser as _;
use swarm_telemetry::escape_lines;

use crate::{args::Args, progress::Progress};

#[tokio::main]
async fn main() -> ExitCode {
    let args = Args::parse();
    let progress = Progress::new(args.output);
    let result = commands::execute(args, progress).await;
    let Err(error) = result else { return ExitCode::SUCCESS };
    if let Some(report) = error.report() {
        // If standard error is closed there is no place left to report to.
        let _ = writeln!(io::stderr(), "{}", escape_lines(&report));
    }
    error.exit_code().into()
}

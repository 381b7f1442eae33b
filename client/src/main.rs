//! `swarmctl`: submit experiments, follow them, read what they found; or run one
//! here and now, coordinator and workers included; or check files and watch robots
//! without any of them.

mod args;
mod clock;
mod commands;
mod connection;
mod error;
mod experiment_file;
#[cfg(test)]
mod fake_coordinator;
mod figure;
mod greeting;
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

use crate::{args::Args, progress::Progress};

#[tokio::main]
async fn main() -> ExitCode {
    let args = Args::parse();
    let progress = Progress::new(args.output);
    let result = commands::execute(args, progress).await;
    let Err(error) = result else { return ExitCode::SUCCESS };
    if let Some(report) = error.report() {
        // Whoever closed standard error does not want to know.
        let _ = writeln!(io::stderr(), "{report}");
    }
    error.exit_code().into()
}

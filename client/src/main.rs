//! `swarmctl`: submits experiments to a coordinator, follows them and reads their
//! results; runs an experiment in this process, with its own coordinator and workers;
//! and checks files and simulates trials without a coordinator.

mod address;
mod args;
mod change;
mod clock;
mod commands;
mod complete;
mod connection;
mod error;
mod experiment_file;
#[cfg(test)]
mod fake_coordinator;
mod figure;
mod genotypes;
mod interrupt;
mod json;
mod place;
mod progress;
mod recorded;
mod resimulation;
mod settings;
mod statistics;
mod sweep;
mod synonyms;
mod table;
mod tensorboard;
mod text;

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::{CommandFactory as _, Parser as _};
use clap_complete::CompleteEnv;
use swarm_telemetry::escape_lines;

use crate::{args::Args, progress::Progress, synonyms::with_suggestions};

#[tokio::main]
async fn main() -> ExitCode {
    // Answers a shell that asks what a command line may become, and ends then.
    CompleteEnv::with_factory(Args::command).complete();
    let args = Args::try_parse().unwrap_or_else(|error| with_suggestions(error).exit());
    let progress = Progress::new(args.output).with_details(args.verbose);
    let result = commands::execute(args, progress).await;
    let Err(error) = result else { return ExitCode::SUCCESS };
    if let Some(report) = error.report() {
        // If standard error is closed there is no place left to report to.
        let _ = writeln!(io::stderr(), "{}", escape_lines(&report));
    }
    error.exit_code().into()
}

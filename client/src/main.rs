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
mod consent;
mod error;
mod experiment_file;
mod experiments;
#[cfg(test)]
mod fake_coordinator;
mod figure;
mod file_kind;
mod genotypes;
mod group;
mod help;
mod input;
mod interrupt;
mod json;
mod output_file;
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
mod waiting;

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::{CommandFactory as _, FromArgMatches as _};
use clap_complete::CompleteEnv;
use swarm_telemetry::{block_on, escape_lines, runtime};

use crate::{args::Args, progress::Progress, synonyms::with_suggestions};

fn main() -> ExitCode {
    // Answers a shell that asks what a command line may become, and ends then.
    CompleteEnv::with_factory(Args::command).complete();
    let args = help::matches().and_then(|matches| Args::from_arg_matches(&matches));
    let args = args.unwrap_or_else(|error| with_suggestions(error).exit());
    let result = match runtime(0) {
        Ok(runtime) => {
            let progress = Progress::new(args.output).with_details(args.verbose);
            block_on(runtime, commands::execute(args, progress))
        }
        Err(starved) => Err(starved.into()),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    // If standard error is closed there is no place left to report to.
    let _ = writeln!(io::stderr(), "{}", escape_lines(&error.report()));
    error.exit_code().into()
}

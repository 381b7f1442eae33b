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
mod examples;
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
mod sweep;
mod synonyms;
mod table;
mod tensorboard;
mod text;
mod waiting;

use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _};
use clap_complete::CompleteEnv;
use swarm_telemetry::{block_on, report, runtime};

use crate::{args::Args, error::Error, progress::Progress, synonyms::with_suggestions};

fn main() -> ExitCode {
    // Answers a shell that asks what a command line may become, and ends then.
    CompleteEnv::with_factory(Args::command).complete();
    let args = help::matches().and_then(|matches| Args::from_arg_matches(&matches));
    let args = args.unwrap_or_else(|error| end(&with_suggestions(error)));
    let result = match runtime(0) {
        Ok(runtime) => {
            let progress = Progress::new(args.output).with_details(args.verbose);
            let unwritten = progress.unwritten();
            block_on(runtime, commands::execute(args, progress)).and_then(|()| unwritten.end())
        }
        Err(starved) => Err(starved.into()),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    report(&error.report_within(table::stderr_width()));
    error.exit_code().into()
}

/// Ends with what the command line gets instead of a command: an error, or help.
fn end(answer: &clap::Error) -> ! {
    let code = match answer.print() {
        Err(source) if !answer.use_stderr() => {
            let error = Error::from_stdout(source);
            report(&error.report_within(table::stderr_width()));
            error.exit_code().into()
        }
        // If standard error is closed, the exit code says enough.
        _ => answer.exit_code(),
    };
    std::process::exit(code)
}

//! `swarmctl`: submits experiments to a coordinator, follows them and reads their
//! results; runs an experiment in this process, with its own coordinator and workers;
//! and checks files and simulates trials without a coordinator.

mod address;
mod args;
mod change;
mod cli;
mod clock;
mod commands;
mod complete;
mod connection;
mod consent;
mod defaults;
mod error;
mod examples;
mod experiment_file;
mod experiments;
#[cfg(test)]
mod fake_coordinator;
mod figure;
mod file_kind;
mod finding;
mod genotypes;
mod group;
mod help;
mod input;
mod interrupt;
mod json;
// Two modules with the same names, with and without a coordinator in this program.
#[cfg(feature = "local")]
mod local;
#[cfg(not(feature = "local"))]
#[path = "without_local.rs"]
mod local;
mod output_file;
mod output_format;
mod pages;
mod place;
mod progress;
mod recorded;
mod remote;
mod resimulation;
mod settings;
mod subject;
mod sweep;
mod synonyms;
mod table;
mod tensorboard;
mod text;
mod waiting;

use std::{env, ffi::OsString, path::Path, process::ExitCode};

use clap::{CommandFactory as _, FromArgMatches as _};
use clap_complete::CompleteEnv;
use swarm_telemetry::{block_on, report, runtime};

use crate::{
    cli::Args,
    error::{Answer, Error, wants_json},
    local::services::{PROGRAMS, Program},
    output_format::OutputFormat,
    progress::Progress,
    synonyms::with_suggestions,
};

fn main() -> ExitCode {
    if let Some((main, words)) = other_program(env::args_os().collect()) {
        return main(words);
    }
    // Answers a shell's request for completions, then ends.
    CompleteEnv::with_factory(Args::command).complete();
    let args = help::matches().and_then(|matches| Args::from_arg_matches(&matches));
    let args = args.unwrap_or_else(|error| end(&with_suggestions(error)));
    let output = args.output;
    let result = match runtime(0) {
        Ok(runtime) => {
            let progress = Progress::new(args.output).with_details(args.verbose);
            let unwritten = progress.unwritten();
            block_on(runtime, commands::execute(args, progress)).and_then(|()| unwritten.end())
        }
        Err(starved) => Err(starved.into()),
    };
    let Err(error) = result else { return ExitCode::SUCCESS };
    report_error(&error, output);
    error.exit_code().into()
}

/// Writes an error to standard error: for people, or for programs as one JSON object.
fn report_error(error: &Error, output: OutputFormat) {
    report(&match output {
        OutputFormat::Json => json::line(&Answer::from(error)),
        _ => error.report_within(table::stderr_width()),
    });
}

/// The program that a command line selects, with its arguments; none for `swarmctl`. The name of
/// this file selects the program, or else the first word after it.
fn other_program(words: Vec<OsString>) -> Option<(Program, Vec<OsString>)> {
    let named = |word: &OsString| PROGRAMS.iter().find(|(name, _)| *word == **name);
    let called = words.first().and_then(|word| Path::new(word).file_stem());
    if let Some((_, main)) = called.and_then(|name| named(&name.to_owned())) {
        return Some((*main, words));
    }
    let (_, main) = words.get(1).and_then(named)?;
    Some((*main, words[1..].to_vec()))
}

/// Ends with an error of the command line, or with help.
fn end(answer: &clap::Error) -> ! {
    if answer.use_stderr() && wants_json(env::args_os()) {
        report(&json::line(&Answer::to_usage(answer)));
        std::process::exit(answer.exit_code());
    }
    let code = match answer.print() {
        Err(source) if !answer.use_stderr() => {
            let error = Error::from_stdout(source);
            report_error(&error, OutputFormat::Table);
            error.exit_code().into()
        }
        // If standard error is closed, the exit code says enough.
        _ => answer.exit_code(),
    };
    std::process::exit(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_programs_are_found_by_their_names() {
        let found = |line: &str| {
            let words = line.split(' ').map(OsString::from).collect();
            let (_, words) = other_program(words)?;
            Some(words.join(&OsString::from(" ")).into_string().unwrap())
        };
        for line in ["coordinator --version", "/opt/swarmevo/worker --slots 2"] {
            assert_eq!(found(line).as_deref(), Some(line));
        }
        assert_eq!(found("swarmctl worker --help").as_deref(), Some("worker --help"));
        for line in ["swarmctl", "swarmctl workers", "swarmctl run coordinator", "my-worker list"] {
            assert_eq!(found(line), None, "{line}");
        }
    }
}

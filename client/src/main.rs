//! `swarmctl`: submit experiments, follow them, read what they found; or run one
//! here and now, coordinator and workers included; or check files and watch robots
//! without any of them.

mod args;
mod connection;
mod error;
mod experiment_file;
#[cfg(test)]
mod fake_coordinator;
mod fleet;
mod interrupt;
mod json;
mod logs;
mod progress;
mod query;
mod run;
mod simulate;
mod submit;
mod text;
mod validate;
mod watch;

use std::{
    io::{self, Write as _},
    process::ExitCode,
};

use clap::Parser as _;

use crate::{
    args::{Args, Command, RemoteCommand},
    connection::Connection,
    error::Error,
    progress::Progress,
};

#[tokio::main]
async fn main() -> ExitCode {
    let args = Args::parse();
    let result = execute(args).await;
    let Err(error) = result else { return ExitCode::SUCCESS };
    if let Some(report) = error.report() {
        // Whoever closed standard error does not want to know.
        let _ = writeln!(io::stderr(), "{report}");
    }
    error.exit_code().into()
}

async fn execute(args: Args) -> Result<(), Error> {
    let mut progress = Progress::new(args.output);
    let command = match args.command {
        // A signal ends these at once: there is nothing to put in order.
        Command::Validate { files } => return validate::validate(&files, &mut progress),
        Command::Schema => {
            return progress.print(&json::document(&sim_core::config::json_schema()));
        }
        Command::Simulate(simulation) => {
            return simulate::simulate(&args.coordinator, &simulation, &mut progress).await;
        }
        // Stops what it started before it ends.
        Command::Run(args) => return run::run(&args, progress, interrupt::token()?).await,
        Command::Remote(command) => command,
    };
    let interrupt = interrupt::token()?;
    let connection = Connection::new(&args.coordinator)?;
    let result = tokio::select! {
        biased;
        () = interrupt.cancelled() => Err(Error::Interrupted("what was submitted goes on".into())),
        result = ask(&connection, command, &mut progress) => result,
    };
    progress.clear();
    result
}

async fn ask(
    connection: &Connection,
    command: RemoteCommand,
    progress: &mut Progress,
) -> Result<(), Error> {
    match command {
        RemoteCommand::Submit(args) => submit::submit(connection, &args, progress).await,
        RemoteCommand::List => query::list(connection, progress).await,
        RemoteCommand::Watch { id } => watch::watch(connection, id, progress).await,
        RemoteCommand::Cancel { id } => query::cancel(connection, id, progress).await,
        RemoteCommand::Champion { id } => query::champion(connection, id, progress).await,
    }
}

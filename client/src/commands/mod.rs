//! The commands, one per module.

mod bench;
mod champion;
mod completions;
mod control;
mod evaluate;
mod explain;
mod history;
mod list;
mod logs;
mod plot;
mod run;
mod simulate;
mod submit;
mod validate;
mod wait;
mod watch;
mod workers;

use crate::{
    args::{Args, Command, OutputFormat, RemoteCommand},
    connection::Connection,
    error::Error,
    interrupt, json,
    progress::Progress,
};

/// Does what the command line asks for.
pub async fn execute(args: Args, mut progress: Progress) -> Result<(), Error> {
    let Args { settings, output, command } = args;
    if output == OutputFormat::Csv && !command.has_table() {
        return Err(Error::Input(
            "`--output csv` is for tables: history, list and workers; this command has table, \
             wide and json"
                .into(),
        ));
    }
    let command = match command {
        // A signal ends these at once: there is nothing to put in order.
        Command::Validate { files } => return validate::validate(&files, &mut progress),
        Command::Schema => {
            return progress
                .print(&json::document(&experiment_file::json_schema(evolution::ALGORITHMS)));
        }
        Command::Simulate(simulation) => {
            return simulate::simulate(settings, &simulation, &mut progress).await;
        }
        Command::Plot(args) => return plot::plot(settings, &args, &mut progress).await,
        Command::Bench(args) => return bench::bench(&args, &mut progress),
        Command::Completions { shell } => return completions::completions(shell, &mut progress),
        // Stops what it started before it ends.
        Command::Run(args) => return run::run(&args, progress, interrupt::token()?).await,
        Command::Evaluate(args) => {
            return evaluate::evaluate(settings, &args, progress, interrupt::token()?).await;
        }
        Command::Remote(command) => command,
    };
    let connection = Connection::open(settings)?;
    let interrupt = interrupt::token()?;
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
        RemoteCommand::List => list::list(connection, progress).await,
        RemoteCommand::Watch { id } => watch::watch(connection, id, progress).await,
        RemoteCommand::Wait(args) => wait::wait(connection, &args, progress).await,
        RemoteCommand::Logs(args) => logs::logs(connection, &args, progress).await,
        RemoteCommand::History { id } => history::history(connection, id, progress).await,
        RemoteCommand::Champion { id } => champion::champion(connection, id, progress).await,
        RemoteCommand::Explain { id } => explain::explain(connection, id, progress).await,
        RemoteCommand::Workers => workers::workers(connection, progress).await,
        RemoteCommand::Pause { id, reason } => {
            control::pause(connection, id, reason, progress).await
        }
        RemoteCommand::Resume { id } => control::resume(connection, id, progress).await,
        RemoteCommand::Priority { id, priority } => {
            control::set_priority(connection, id, priority, progress).await
        }
        RemoteCommand::Cancel { id } => control::cancel(connection, id, progress).await,
    }
}

#[cfg(test)]
mod tests;

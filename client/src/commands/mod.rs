//! The commands: their arguments with their help, their requests and their output. Commands
//! that send requests to a coordinator are declared in families, each at the top of a file.

pub mod answers;
mod backup;
mod bench;
mod champion_file;
mod compare;
mod completions;
mod compute;
pub mod control;
mod doctor;
mod elites;
mod evaluate;
mod examples;
mod explain;
mod export;
mod export_controller;
pub mod fleet;
mod fork;
mod front;
mod genotype_args;
mod get;
mod history;
mod import;
pub mod individual;
pub mod keep;
mod lineage;
mod list;
pub mod look;
mod man;
mod new;
mod old_words;
mod plot;
mod reordered;
mod repertoire;
mod replay;
mod run;
pub mod schema;
mod simulate;
pub mod submit;
mod validate;
mod verify;
mod watch;
mod web;
mod workers;

use clap::Subcommand;
use tokio_util::sync::CancellationToken;

use crate::{
    cli::Args,
    connection::Connection,
    error::{Code, Error},
    interrupt,
    local::services::serve_referee,
    output_format::OutputFormat,
    place::{Intent, Place, data_dir},
    progress::Progress,
    remote::{Remote, family},
};

/// All commands, in the order of the help.
#[derive(Debug, Subcommand)]
pub enum Command {
    Run(run::RunArgs),
    #[command(flatten)]
    Remote(RemoteCommand),
    New(new::NewArgs),
    Examples(examples::ExamplesArgs),
    Validate(validate::ValidateArgs),
    Schema(schema::SchemaArgs),
    Simulate(simulate::SimulateArgs),
    Replay(replay::ReplayArgs),
    Web(web::WebArgs),
    Evaluate(evaluate::EvaluateArgs),
    ExportController(export_controller::ExportControllerArgs),
    Verify(verify::VerifyArgs),
    Plot(plot::PlotArgs),
    Compare(compare::CompareArgs),
    Bench(bench::BenchArgs),
    Doctor(doctor::DoctorArgs),
    Backup(backup::BackupArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
    /// Evaluate items for the coordinator of `run`, which starts this process itself.
    ///
    /// Reads requests from standard input and writes answers to standard output, in a
    /// format of this release; ends when standard input ends.
    #[command(hide = true)]
    Referee,
}

family! {
    /// The commands that send requests to a coordinator, by purpose.
    RemoteCommand {
        #[command(flatten)]
        Evolve(submit::Evolve),
        #[command(flatten)]
        Look(look::Look),
        #[command(flatten)]
        Measure(individual::Measure),
        #[command(flatten)]
        Control(control::Control),
        #[command(flatten)]
        Keep(keep::Keep),
        #[command(flatten)]
        Fleet(fleet::Fleet),
        #[command(flatten)]
        OldWords(old_words::OldWords),
    }
}

/// Executes the command of a command line.
pub async fn execute(args: Args, mut progress: Progress) -> Result<(), Error> {
    let Args { settings, output, command, .. } = args;
    let has_table = matches!(&command, Command::Remote(command) if command.has_table());
    if output == OutputFormat::Csv && !has_table {
        return Err(Error::at(
            Code::BadArgument,
            "--output",
            "`--output csv` is for tables: front, history, list, repertoire and workers; this command \
             has table, wide and json",
        ));
    }
    if matches!(&command, Command::Remote(command) if command.ends_with_reader()) {
        progress.end_with_reader();
    }
    let command = match command {
        // An interrupt ends these commands at once, and removes their unfinished files.
        Command::Validate(args) => return validate::validate(&args, &mut progress),
        Command::New(args) => return new::new(&args, &mut progress),
        Command::Examples(_) => return examples::examples(&mut progress),
        Command::Schema(args) => return schema::schema(&args, &mut progress),
        Command::Simulate(args) => {
            return simulate::simulate(settings, &args, &mut progress).await;
        }
        Command::Replay(args) => return replay::replay(settings, &args, &mut progress).await,
        Command::ExportController(args) => {
            return export_controller::export_controller(settings, &args, &mut progress).await;
        }
        Command::Verify(args) => return verify::verify(settings, &args, &mut progress).await,
        Command::Plot(args) => return plot::plot(settings, &args, &mut progress).await,
        Command::Compare(args) => return compare::compare(settings, &args, &mut progress).await,
        Command::Bench(args) => return bench::bench(&args, &mut progress),
        Command::Doctor(args) => {
            return doctor::doctor(&data_dir(&settings), &args, &mut progress);
        }
        Command::Backup(args) => {
            return backup::backup(&data_dir(&settings), &args, &mut progress);
        }
        Command::Completions(args) => return completions::completions(args.shell, &mut progress),
        Command::Man(args) => return man::man(&args, &mut progress),
        Command::Referee => {
            return serve_referee();
        }
        // These commands start a coordinator and workers, and stop them when interrupted.
        Command::Run(args) => {
            return run::run(settings, &args, progress, interrupt::token()?).await;
        }
        Command::Web(args) => {
            return web::web(&settings, &args, &mut progress, interrupt::token()?).await;
        }
        Command::Evaluate(args) => {
            return evaluate::evaluate(settings, &args, progress, interrupt::token()?).await;
        }
        Command::Remote(command) => command,
    };
    let interrupt = interrupt::token()?;
    let intent = command.intent();
    let place = Place::find(settings).await?;
    progress.found(&place);
    match place {
        Place::Directory { path, .. } if intent.computes() => {
            compute::compute(&path, command, &mut progress, interrupt).await
        }
        place => {
            let connection = Connection::to(place, intent).await?;
            ask(connection, command, intent, &mut progress, interrupt).await
        }
    }
}

/// Executes a command that an interrupt may end at any time. The command itself sees an interrupt
/// first: one that changes experiments then prints those that it has changed.
async fn ask(
    connection: Connection,
    command: RemoteCommand,
    intent: Intent,
    progress: &mut Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    let result = tokio::select! {
        biased;
        result = command.execute(&connection, progress) => result,
        () = interrupt.cancelled() => Err(match intent {
            Intent::Read => Error::Interrupted("this command changes no experiment".into()),
            _ => interrupt::error(),
        }),
    };
    progress.clear();
    connection.close().await;
    result
}

#[cfg(test)]
mod tests;

//! The commands, each in a module of its own: its arguments with their help, its
//! requests and its output. To add one, write the module and name it twice below.

mod backup;
mod bench;
mod champion_file;
mod compare;
mod completions;
mod compute;
mod control;
mod doctor;
mod evaluate;
mod examples;
mod explain;
mod export;
mod fleet;
mod fork;
mod get;
mod history;
mod import;
mod individual;
mod keep;
mod lineage;
mod list;
mod logs;
mod man;
mod new;
mod plot;
mod reopen;
mod reordered;
mod replay;
mod run;
mod schema;
mod simulate;
mod submit;
mod validate;
mod verify;
mod wait;
mod watch;
mod web;
mod workers;

pub use explain::Finding;

use clap::Subcommand;
use tokio_util::sync::CancellationToken;

use crate::{
    args::{Args, OutputFormat},
    connection::Connection,
    error::Error,
    interrupt,
    local::services::serve_referee,
    place::{Intent, Place, data_dir},
    progress::Progress,
};

/// The commands, in the order of the help.
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

/// The arguments of a command that sends requests to a coordinator and does nothing
/// else, so that an interrupt may end it at any time.
trait Remote: clap::Args {
    /// Whether its answer is a table, which can be printed as CSV.
    const HAS_TABLE: bool = false;

    /// What it does with experiments.
    fn intent(&self) -> Intent {
        Intent::Read
    }

    /// Finds mistakes before anything is touched.
    fn check(&self) -> Result<(), Error> {
        Ok(())
    }

    /// Sends the requests and prints the answers.
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error>;
}

macro_rules! remote_commands {
    ($($(#[$attribute:meta])* $name:ident($args:ty),)*) => {
        /// The commands that are requests to a coordinator, in the order of the help.
        #[derive(Debug, Subcommand)]
        pub enum RemoteCommand {
            $($(#[$attribute])* $name($args),)*
        }

        impl RemoteCommand {
            /// Whether the answer is a table, which can be printed as CSV.
            fn has_table(&self) -> bool {
                match self {
                    $(Self::$name(_) => <$args as Remote>::HAS_TABLE,)*
                }
            }

            /// What it does with experiments.
            fn intent(&self) -> Intent {
                match self {
                    $(Self::$name(args) => args.intent(),)*
                }
            }

            /// Finds mistakes before anything is touched.
            fn check(&self) -> Result<(), Error> {
                match self {
                    $(Self::$name(args) => args.check(),)*
                }
            }

            async fn execute(
                self,
                connection: &Connection,
                progress: &mut Progress,
            ) -> Result<(), Error> {
                match self {
                    $(Self::$name(args) => args.execute(connection, progress).await,)*
                }
            }
        }
    };
}

remote_commands! {
    Submit(submit::SubmitArgs),
    Fork(fork::ForkArgs),
    List(list::ListArgs),
    Watch(watch::WatchArgs),
    Wait(wait::WaitArgs),
    Logs(logs::LogsArgs),
    History(history::HistoryArgs),
    Explain(explain::ExplainArgs),
    Workers(workers::WorkersArgs),
    Fleet(fleet::FleetArgs),
    Pause(control::PauseArgs),
    Resume(control::ResumeArgs),
    Priority(control::PriorityArgs),
    Cancel(control::CancelArgs),
    Extend(reopen::ExtendArgs),
    Retry(reopen::RetryArgs),
    Get(get::GetArgs),
    #[command(visible_alias = "champion")]
    Individual(individual::IndividualArgs),
    Lineage(lineage::LineageArgs),
    Export(export::ExportArgs),
    Label(keep::LabelArgs),
    Archive(keep::ArchiveArgs),
    Prune(keep::PruneArgs),
    Delete(keep::DeleteArgs),
    Import(import::ImportArgs),
}

/// Executes the command of a command line.
pub async fn execute(args: Args, mut progress: Progress) -> Result<(), Error> {
    let Args { settings, output, command, .. } = args;
    let has_table = matches!(&command, Command::Remote(command) if command.has_table());
    if output == OutputFormat::Csv && !has_table {
        return Err(Error::Input(
            "`--output csv` is for tables: history, list and workers; this command has table, \
             wide and json"
                .into(),
        ));
    }
    if matches!(&command, Command::Remote(RemoteCommand::Watch(_) | RemoteCommand::Logs(_))) {
        progress.end_with_reader();
    }
    let command = match command {
        // An interrupt ends these at once, and removes the files that they have begun.
        Command::Validate(args) => return validate::validate(&args, &mut progress),
        Command::New(args) => return new::new(&args, &mut progress),
        Command::Examples(_) => return examples::examples(&mut progress),
        Command::Schema(_) => return schema::schema(&mut progress),
        Command::Simulate(args) => {
            return simulate::simulate(settings, &args, &mut progress).await;
        }
        Command::Replay(args) => return replay::replay(settings, &args, &mut progress).await,
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
        // These start a coordinator and workers, and stop them when interrupted.
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

/// Executes a command that an interrupt may end at any time.
async fn ask(
    connection: Connection,
    command: RemoteCommand,
    intent: Intent,
    progress: &mut Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    let result = tokio::select! {
        biased;
        () = interrupt.cancelled() => Err(match intent {
            Intent::Read => Error::Interrupted("this changes no experiment".into()),
            Intent::Submit | Intent::Continue if connection.data_dir().is_none() => {
                interrupt::error()
            }
            _ => Error::Interrupted("nothing is changed that was not printed".into()),
        }),
        result = command.execute(&connection, progress) => result,
    };
    progress.clear();
    connection.close().await;
    result
}

#[cfg(all(test, feature = "local"))]
mod one_world;
#[cfg(test)]
mod tests;

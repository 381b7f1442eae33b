//! Commands that start experiments in a data directory: this process computes them to the end,
//! like `run`.

use std::path::Path;

use sim_core::Isa;
use tokio_util::sync::CancellationToken;

use super::{RemoteCommand, run::log};
use crate::{
    args::cores, connection::Connection, error::Error, interrupt, local::fleet::Fleet,
    progress::Progress, remote::Remote, text,
};

/// Executes a command with its own coordinator and workers, and stops them even if the command
/// fails.
pub async fn compute(
    data_dir: &Path,
    command: RemoteCommand,
    progress: &mut Progress,
    interrupt: CancellationToken,
) -> Result<(), Error> {
    command.check()?;
    command.intent().check(data_dir)?;
    log::init(progress.stderr());
    let mut fleet = Fleet::start(data_dir, cores(), Isa::best(), None).await?;
    let connection = fleet.connection();
    let result = tokio::select! {
        biased;
        // The command itself sees an interrupt first, to print what it has changed.
        result = command.execute(&connection, progress) => result,
        () = interrupt.cancelled() => Err(interrupted(&connection, data_dir)),
        error = fleet.failure() => Err(error),
    };
    progress.clear();
    fleet.stop(&result, progress).await;
    result
}

fn interrupted(connection: &Connection, data_dir: &Path) -> Error {
    let directory = data_dir.display().to_string();
    let resume = |id: u64| format!("\n  {}", text::command_in("resume", id, data_dir));
    let commands: String = connection.going().into_iter().map(resume).collect();
    if commands.is_empty() {
        return interrupt::error();
    }
    Error::Interrupted(format!(
        "{directory} stores all complete generations. Continue with:{commands}"
    ))
}

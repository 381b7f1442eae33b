//! Commands that set experiments going, on a data directory: this process computes them, to the
//! end, as `run` does.

use std::path::Path;

use sim_core::Isa;
use tokio_util::sync::CancellationToken;

use super::{RemoteCommand, run::log};
use crate::{
    args::cores, connection::Connection, error::Error, local::fleet::Fleet, progress::Progress,
    remote::Remote, text,
};

/// Executes a command with a coordinator and workers of its own, and stops them even if it fails.
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
        () = interrupt.cancelled() => Err(interrupted(&connection, data_dir)),
        result = command.execute(&connection, progress) => result,
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
    Error::Interrupted(match &*commands {
        "" => "nothing was set going".to_owned(),
        commands => {
            format!("all complete generations are stored in {directory}. Continue with:{commands}")
        }
    })
}

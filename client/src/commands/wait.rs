//! `swarmctl wait`: blocks until an experiment ends.

use std::time::Duration;

use swarm_proto::v1::Experiment;
use tokio::time::{sleep, timeout};

use crate::{
    args::{WaitArgs, WaitFor},
    connection::{Connection, PATIENCE_WHILE_FOLLOWING},
    error::Error,
    json::{self, has_ended},
    progress::Progress,
    text,
};

/// Between questions.
const INTERVAL: Duration = Duration::from_secs(1);

/// Prints how it ended.
pub async fn wait(
    connection: &Connection,
    args: &WaitArgs,
    progress: &mut Progress,
) -> Result<(), Error> {
    // An experiment that is not there is known at once.
    connection.experiment(args.id).await?;
    let connection = connection.with_patience(PATIENCE_WHILE_FOLLOWING);
    let ended = ended(&connection, args.id);
    let experiment = match args.timeout {
        Some(limit) => timeout(limit, ended).await.map_err(|_| Error::TimedOut { id: args.id })?,
        None => ended.await,
    }?;
    progress.print(&if progress.is_json() {
        json::line(&json::ExperimentDocument::from(&experiment))
    } else {
        text::standing(&experiment)
    })?;
    match args.target {
        WaitFor::Completed => super::watch::verdict(&experiment),
        WaitFor::Ended => Ok(()),
    }
}

/// The experiment, once it has ended.
async fn ended(connection: &Connection, experiment_id: u64) -> Result<Experiment, Error> {
    loop {
        let experiment = connection.experiment(experiment_id).await?;
        if has_ended(experiment.state()) {
            return Ok(experiment);
        }
        sleep(INTERVAL).await;
    }
}

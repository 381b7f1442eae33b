//! Waits for the end of experiments, and prints how they ended.

use std::time::Duration;

use clap::ValueEnum;
use tokio::time::{Instant, timeout_at};

use super::{deserted, ended, success};
use crate::{
    connection::Connection, error::Error, json, progress::Progress, subject::Subject, text,
};

/// The end that counts as success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum WaitFor {
    /// All generations done, or the target fitness reached.
    Completed,
    /// Any end: completed, failed or cancelled.
    Ended,
}

/// Waits until an experiment or all of a group have ended. `limit`: the maximum time.
pub async fn wait(
    connection: &Connection,
    subject: &Subject,
    end: WaitFor,
    limit: Option<Duration>,
    progress: &mut Progress,
) -> Result<(), Error> {
    let deadline = limit.map(|limit| Instant::now() + limit);
    let mut outcome = Ok(());
    // One after the other: the order does not change the time until all have ended.
    for experiment in connection.subject(subject).await? {
        let id = experiment.id;
        let of = [experiment.clone()];
        let ended = async {
            tokio::select! {
                ended = ended(connection, experiment, progress) => ended,
                error = deserted(connection, &of) => Err(error),
            }
        };
        let experiment = match deadline {
            Some(at) => timeout_at(at, ended).await.map_err(|_| {
                let explain = connection.command(&["explain", &id.to_string()]);
                Error::TimedOut { id, explain }
            })?,
            None => ended.await,
        }?;
        if progress.is_json() {
            progress.print_line(&json::ExperimentDocument::from(&experiment))?;
        } else {
            progress.print(&text::state_line(&experiment))?;
        }
        if end == WaitFor::Completed {
            outcome = outcome.and(success(&experiment));
        }
    }
    outcome
}

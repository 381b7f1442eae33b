//! `swarmctl wait`: blocks until an experiment ends.

use std::time::Duration;

use clap::{Args, ValueEnum};
use swarm_telemetry::parse_duration;
use tokio::time::{Instant, timeout_at};

use super::{Remote, watch};
use crate::{args::Target, connection::Connection, error::Error, json, progress::Progress, text};

/// Wait until an experiment ends, or all experiments of a group.
///
/// Standard error says what keeps an experiment from being computed, such as a lack of workers.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct WaitArgs {
    #[command(flatten)]
    experiments: Target,
    /// Which end counts as success.
    #[arg(long = "for", value_enum, default_value_t = WaitFor::Completed, value_name = "END")]
    target: WaitFor,
    /// Stop waiting after this time: 90s, 15m, 2h [default: no limit]
    #[arg(long, value_name = "TIME", value_parser = parse_duration)]
    timeout: Option<Duration>,
}

/// Which end counts as success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum WaitFor {
    /// All generations done, or the target fitness reached.
    Completed,
    /// Any end: completed, failed or cancelled.
    Ended,
}

const HELP: &str = "\
Exit codes:
  0   the experiment ended as --for demands
  5   it failed, and --for is completed
  6   it was cancelled, and --for is completed
  10  it has not ended within --timeout

Examples:
  swarmctl wait 3 && swarmctl champion 3 > champion.json
  swarmctl wait 3 --for ended --timeout 2h
  swarmctl wait leader_selection_snes && swarmctl compare leader_selection_snes";

impl Remote for WaitArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let deadline = self.timeout.map(|limit| Instant::now() + limit);
        let mut success = Ok(());
        // One after the other: the last to end is waited for in any order.
        for experiment in connection.subject(&self.experiments.subject).await? {
            let id = experiment.id;
            let of = [experiment.clone()];
            let ended = async {
                tokio::select! {
                    ended = watch::ended(connection, experiment, progress) => ended,
                    error = watch::deserted(connection, &of) => Err(error),
                }
            };
            let experiment = match deadline {
                Some(at) => timeout_at(at, ended).await.map_err(|_| Error::TimedOut { id })?,
                None => ended.await,
            }?;
            progress.print(&if progress.is_json() {
                json::line(&json::ExperimentDocument::from(&experiment))
            } else {
                text::state_line(&experiment)
            })?;
            if self.target == WaitFor::Completed {
                success = success.and(watch::success(&experiment));
            }
        }
        success
    }
}

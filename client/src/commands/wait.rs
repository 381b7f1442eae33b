//! `swarmctl wait`: blocks until an experiment ends.

use std::time::Duration;

use clap::{Args, ValueEnum};
use tokio::time::timeout;

use super::Remote;
use crate::{
    args::ExperimentId, connection::Connection, error::Error, json, progress::Progress, text,
};

/// Wait until an experiment ends.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct WaitArgs {
    #[command(flatten)]
    experiment: ExperimentId,
    /// Which end counts as success.
    #[arg(long = "for", value_enum, default_value_t = WaitFor::Completed, value_name = "END")]
    target: WaitFor,
    /// Stop waiting after this time: 90s, 15m, 2h [default: no limit]
    #[arg(long, value_name = "TIME", value_parser = duration)]
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
  swarmctl wait 3 --for ended --timeout 2h";

impl Remote for WaitArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let id = self.experiment.id;
        let ended = super::watch::ended(connection, connection.experiment(id).await?);
        let experiment = match self.timeout {
            Some(limit) => timeout(limit, ended).await.map_err(|_| Error::TimedOut { id })?,
            None => ended.await,
        }?;
        progress.print(&if progress.is_json() {
            json::line(&json::ExperimentDocument::from(&experiment))
        } else {
            text::state_line(&experiment)
        })?;
        match self.target {
            WaitFor::Completed => super::watch::success(&experiment),
            WaitFor::Ended => Ok(()),
        }
    }
}

/// Parses a time with its unit: s, m or h.
fn duration(text: &str) -> Result<Duration, String> {
    let n_digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let (number, unit) = text.split_at(n_digits);
    let unit_s = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3600,
        _ => return Err("expected a number and its unit: 90s, 15m or 2h".into()),
    };
    let number: u32 = number.parse().map_err(|_| "expected a smaller number")?;
    Ok(Duration::from_secs(u64::from(number) * unit_s))
}

//! Commands of earlier releases that `resume` and `watch` have replaced. No help shows
//! them.

use std::time::Duration;

use clap::Args;
use clap_complete::ArgValueCompleter;
use experiment_file::limits;
use swarm_proto::v1::{ExperimentState, RetryExperimentRequest};
use swarm_telemetry::parse_duration;

use super::{
    control::{extend, follow},
    watch::{
        events::{self, Wanted},
        quiet::{self, WaitFor},
    },
};
use crate::{
    args::{Target, whole},
    complete,
    connection::{Connection, present},
    error::Error,
    group::{change_each, members},
    place::Intent,
    progress::Progress,
    remote::{Remote, family},
    subject::Subject,
};

family! {
    /// Commands of earlier releases.
    OldWords {
        #[command(hide = true)]
        Extend(ExtendArgs),
        #[command(hide = true)]
        Retry(RetryArgs),
        #[command(hide = true)]
        Wait(WaitArgs),
        #[command(hide = true)]
        Logs(LogsArgs),
    }
}

/// Like `resume --generations`.
#[derive(Debug, Args)]
pub struct ExtendArgs {
    #[command(flatten)]
    target: Target,
    /// Number of generations in all, from the first.
    #[arg(long, value_name = "G", value_parser = whole(1..=limits::GENERATIONS))]
    generations: u64,
}

impl Remote for ExtendArgs {
    fn intent(&self) -> Intent {
        Intent::Continue
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        extend(&self.target, self.generations, connection, progress).await
    }
}

/// Like `resume`, for failed experiments only.
#[derive(Debug, Args)]
pub struct RetryArgs {
    #[command(flatten)]
    target: Target,
}

impl Remote for RetryArgs {
    fn intent(&self) -> Intent {
        Intent::Continue
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let retry = async |experiment_id| {
            let request = RetryExperimentRequest { experiment_id };
            let call = connection.call(async |client| client.retry_experiment(request).await);
            present(call.await?.experiment)
        };
        let has_failed = |state| state == ExperimentState::Failed;
        let why_none = "no experiment of group `NAME` has failed";
        let members = members(&self.target, connection, has_failed, why_none).await?;
        let outcome = change_each(&members, progress, retry).await;
        follow(&self.target, outcome, connection, progress).await
    }
}

/// Like `watch --quiet`.
#[derive(Debug, Args)]
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

impl Remote for WaitArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { experiments, target, timeout } = self;
        quiet::wait(connection, &experiments.subject, target, timeout, progress).await
    }
}

/// Like `watch --events --so-far`; with --follow like `watch --events`.
#[derive(Debug, Args)]
pub struct LogsArgs {
    /// Number or name of the experiment, or name of a group [default: all, in the order of
    /// time]
    #[arg(value_name = "ID|NAME", add = ArgValueCompleter::new(complete::experiments))]
    id: Option<Subject>,
    /// Keep printing new events; for an experiment or a group, until it ends.
    #[arg(long, short)]
    follow: bool,
    /// Start at the event with this sequence number.
    #[arg(long = "from", value_name = "SEQ", default_value_t = 1, requires = "id")]
    from_sequence: u64,
}

impl Remote for LogsArgs {
    fn ends_with_reader(&self) -> bool {
        true
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { id: subject, follow, from_sequence } = self;
        events::print(&Wanted { subject, follow, from_sequence }, connection, progress).await
    }
}

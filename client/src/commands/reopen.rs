//! `swarmctl extend` and `retry`: an experiment that has ended goes on.

use clap::Args;
use experiment_file::limits;
use swarm_proto::v1::{ExperimentState, ExtendExperimentRequest, RetryExperimentRequest};

use super::{Remote, control::follow};
use crate::{
    args::{Target, whole},
    connection::{Connection, present},
    error::Error,
    group::{change_each, members},
    place::Intent,
    progress::Progress,
};

/// Continue a completed experiment, or those of a group, to more generations.
///
/// It goes on from its last generation, to the same bits as if it had been asked for all of
/// them at first: generations, re-evaluations, champion and digests. The champion is judged
/// again at the new end, on other trials. An experiment that has reached its target fitness is
/// not extended: `fork` goes on from it under another target.
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
        let Self { target, generations } = self;
        let extend = async |experiment_id| {
            let request = ExtendExperimentRequest { experiment_id, generations };
            let call = connection.call(async |client| client.extend_experiment(request).await);
            present(call.await?.experiment)
        };
        let is_completed = |state| state == ExperimentState::Completed;
        let why_none = "no experiment of group `NAME` has completed";
        let members = members(&target, connection, is_completed, why_none).await?;
        let outcome = change_each(&members, progress, extend).await;
        follow(&target, outcome, connection, progress).await
    }
}

/// Continue a failed experiment, or those of a group, once the cause is gone.
///
/// It goes on from its last stored generation, to the same bits as if it had not failed.
/// `swarmctl logs ID` says why it failed.
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

//! `swarmctl pause`, `resume`, `priority` and `cancel`: commands that change the state or the
//! share of an experiment, or of each of a group, and print what they changed.

use clap::Args;
use swarm_proto::v1::{
    CancelExperimentRequest, Experiment, ExperimentState, PauseExperimentRequest,
    ResumeExperimentRequest, SetPriorityRequest,
};

use super::{Remote, watch};
use crate::{
    args::{Subject, Target, whole},
    connection::{Connection, present},
    error::Error,
    json::{self, has_ended},
    place::Intent,
    progress::Progress,
    text,
};

/// Pause an experiment, or a group: workers get no items of it until it is resumed.
///
/// It stays paused when the coordinator restarts; `swarmctl resume` continues it.
/// A pause changes no bit of the results.
#[derive(Debug, Args)]
pub struct PauseArgs {
    #[command(flatten)]
    target: Target,
    /// Reason of the pause; list, logs and explain show it.
    #[arg(long, value_name = "TEXT")]
    reason: Option<String>,
}

impl Remote for PauseArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let reason = self.reason.unwrap_or_default();
        let pause = async |experiment_id| {
            let request = PauseExperimentRequest { experiment_id, reason: reason.clone() };
            let call =
                connection.call(async |client| client.pause_experiment(request.clone()).await);
            present(call.await?.experiment)
        };
        let changed = each(&self.target, connection, pause).await?;
        let resume = format!("continue with: swarmctl resume {}", self.target.subject);
        let lines = changed.iter().map(text::state_line).chain([resume]);
        print(&self.target, &changed, lines, progress)
    }
}

/// Continue a paused experiment, or those of a group; or one that was cancelled.
///
/// It goes on from its last stored generation, to the same bits. Of a group, those that are
/// paused are continued; one that was cancelled is continued by its number. `retry` continues
/// one that has failed, `extend` one that has completed.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    #[command(flatten)]
    target: Target,
}

impl Remote for ResumeArgs {
    fn intent(&self) -> Intent {
        Intent::Continue
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let resume = async |experiment_id| {
            let request = ResumeExperimentRequest { experiment_id };
            let call = connection.call(async |client| client.resume_experiment(request).await);
            present(call.await?.experiment)
        };
        let changed = each(&self.target, connection, resume).await?;
        follow(&self.target, changed, connection, progress).await
    }
}

/// Change the share of the fleet of an experiment, or of each of a group.
///
/// While several experiments have items for the workers, each gets a share of the
/// workers' time in proportion to its priority.
#[derive(Debug, Args)]
pub struct PriorityArgs {
    #[command(flatten)]
    target: Target,
    /// New priority, 1 to 1000; an experiment starts with 100.
    #[arg(value_name = "N", value_parser = whole::<u32>(1..=1000))]
    priority: u32,
}

impl Remote for PriorityArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { target, priority } = self;
        let set = async |experiment_id| {
            let request = SetPriorityRequest { experiment_id, priority };
            let call = connection.call(async |client| client.set_priority(request).await);
            present(call.await?.experiment)
        };
        let changed = each(&target, connection, set).await?;
        let line = |it: &Experiment| format!("{}: priority {}", text::title(it), it.priority);
        print(&target, &changed, changed.iter().map(line), progress)
    }
}

/// End an experiment, or a group, early; history and champion stay stored.
#[derive(Debug, Args)]
pub struct CancelArgs {
    #[command(flatten)]
    target: Target,
}

impl Remote for CancelArgs {
    fn intent(&self) -> Intent {
        Intent::Change
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let cancel = async |experiment_id| {
            let request = CancelExperimentRequest { experiment_id };
            let call = connection.call(async |client| client.cancel_experiment(request).await);
            present(call.await?.experiment)
        };
        let changed = each(&self.target, connection, cancel).await?;
        print(&self.target, &changed, changed.iter().map(text::cancelled), progress)
    }
}

/// Changes an experiment, or every one of a group that has not ended.
async fn each(
    target: &Target,
    connection: &Connection,
    change: impl AsyncFn(u64) -> Result<Experiment, Error>,
) -> Result<Vec<Experiment>, Error> {
    let why_none = "all experiments of group `NAME` have ended";
    each_that(target, connection, |state| !has_ended(state), why_none, change).await
}

/// Changes an experiment, or those of a group whose state is such. `why_none`: the error if
/// there are none in the group NAME.
pub async fn each_that<T>(
    target: &Target,
    connection: &Connection,
    applies: impl Fn(ExperimentState) -> bool,
    why_none: &str,
    change: impl AsyncFn(u64) -> Result<T, Error>,
) -> Result<Vec<T>, Error> {
    let name = match &target.subject {
        Subject::Experiment(id) => return Ok(vec![change(*id).await?]),
        Subject::Group(name) => name,
    };
    let members = connection.group(name).await?;
    let mut changed = Vec::new();
    for experiment in &members {
        // Of one alone, the coordinator says what is wrong with its state.
        if members.len() == 1 || applies(experiment.state()) {
            changed.push(change(experiment.id).await?);
        }
    }
    match changed.is_empty() {
        true => Err(Error::NotFound(why_none.replace("NAME", name))),
        false => Ok(changed),
    }
}

/// Prints what goes on; follows it to its end if this process computes it.
pub async fn follow(
    target: &Target,
    changed: Vec<Experiment>,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    if !connection.computes() || !progress.is_json() {
        print(target, &changed, changed.iter().map(text::state_line), progress)?;
    }
    if connection.computes() { watch::watch(connection, changed, progress).await } else { Ok(()) }
}

/// Prints what was changed, as lines or as JSON.
pub fn print(
    target: &Target,
    changed: &[Experiment],
    lines: impl Iterator<Item = String>,
    progress: &mut Progress,
) -> Result<(), Error> {
    if progress.is_json() {
        progress.print(&json::experiments(&target.subject, changed))
    } else {
        progress.print(&lines.collect::<Vec<_>>().join("\n"))
    }
}

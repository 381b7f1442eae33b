//! `swarmctl pause`, `resume`, `priority` and `cancel`: commands that change the state or the
//! share of an experiment, or of each experiment of a group, and print the changes.

use clap::Args;
use experiment_file::limits;
use model::wire::has_ended;
use swarm_proto::v1::{
    CancelExperimentRequest, Experiment, ExperimentState, ExtendExperimentRequest,
    PauseExperimentRequest, ResumeExperimentRequest, SetPriorityRequest,
};

use super::watch;
use crate::{
    args::{Target, whole},
    connection::{Connection, present},
    error::Error,
    group::{Outcome, change_each, members},
    json::{ExperimentDocument, OneOrMore},
    place::Intent,
    progress::Progress,
    remote::{Remote, family},
    text,
};

family! {
    /// Commands that steer experiments.
    Control {
        Pause(PauseArgs),
        Resume(ResumeArgs),
        Priority(PriorityArgs),
        Cancel(CancelArgs),
    }
}

/// Pause an experiment, or a group: workers get none of its items until you resume it.
///
/// It stays paused when the coordinator restarts; `swarmctl resume` continues it.
/// A pause changes no bit of the results.
#[derive(Debug, Args)]
pub struct PauseArgs {
    #[command(flatten)]
    target: Target,
    /// Reason for the pause; list and explain show it.
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
        let outcome = each(&self.target, connection, progress, pause).await?;
        let is_any_paused = !outcome.changed.is_empty();
        let printed = print(&self.target, outcome, text::state_line, progress);
        if is_any_paused && !progress.is_json() {
            let resume = connection.command(&["resume", &self.target.subject.to_string()]);
            progress.print(&format!("continue with: {resume}"))?;
        }
        printed
    }
}

/// Continue a paused, failed or cancelled experiment, or a group, or extend a completed one.
///
/// An experiment continues from its last stored generation, to the same bits as if it had never
/// stopped. Of a group, the command continues paused and failed experiments; to continue a
/// cancelled one, give its number. With --generations, it extends completed experiments:
/// generations, re-evaluations, champion and digests become those of a run that had the new length
/// from the start, and the champion is judged again at the new end, on other trials. An experiment
/// that has reached its target fitness cannot be extended: `fork` continues it under another
/// target.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    #[command(flatten)]
    target: Target,
    /// Extend completed experiments to this total number of generations.
    #[arg(long, value_name = "G", value_parser = whole(1..=limits::GENERATIONS))]
    generations: Option<u64>,
}

impl Remote for ResumeArgs {
    fn intent(&self) -> Intent {
        Intent::Continue
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { target, generations } = self;
        match generations {
            Some(generations) => extend(&target, generations, connection, progress).await,
            None => resume(&target, connection, progress).await,
        }
    }
}

async fn resume(
    target: &Target,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let resume = async |experiment_id| {
        let request = ResumeExperimentRequest { experiment_id };
        let call = connection.call(async |client| client.resume_experiment(request).await);
        present(call.await?.experiment)
    };
    let goes_on = |state| state == ExperimentState::Failed || !has_ended(state);
    let why_none = "all experiments of group `NAME` have completed or were cancelled";
    let members = members(target, connection, goes_on, why_none).await?;
    let outcome = change_each(&members, progress, resume).await;
    follow(target, outcome, connection, progress).await
}

/// Extends completed experiments to a total number of generations.
pub async fn extend(
    target: &Target,
    generations: u64,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let extend = async |experiment_id| {
        let request = ExtendExperimentRequest { experiment_id, generations };
        let call = connection.call(async |client| client.extend_experiment(request).await);
        present(call.await?.experiment)
    };
    let is_completed = |state| state == ExperimentState::Completed;
    let why_none = "no experiment of group `NAME` has completed";
    let members = members(target, connection, is_completed, why_none).await?;
    let outcome = change_each(&members, progress, extend).await;
    follow(target, outcome, connection, progress).await
}

/// Change an experiment's share of the fleet, or that of each experiment of a group.
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
        let outcome = each(&target, connection, progress, set).await?;
        let line = |experiment: &Experiment| {
            format!("{}: priority {}", text::title(experiment), experiment.priority)
        };
        print(&target, outcome, line, progress)
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
        let outcome = each(&self.target, connection, progress, cancel).await?;
        print(&self.target, outcome, text::cancelled, progress)
    }
}

/// Changes an experiment, or each unfinished experiment of a group.
async fn each(
    target: &Target,
    connection: &Connection,
    progress: &mut Progress,
    change: impl AsyncFn(u64) -> Result<Experiment, Error>,
) -> Result<Outcome<Experiment>, Error> {
    let why_none = "all experiments of group `NAME` have ended";
    let members = members(target, connection, |state| !has_ended(state), why_none).await?;
    Ok(change_each(&members, progress, change).await)
}

/// Prints the continued experiments; follows them to their end if this process computes
/// them, unless an interrupt came.
pub async fn follow(
    target: &Target,
    outcome: Outcome<Experiment>,
    connection: &Connection,
    progress: &mut Progress,
) -> Result<(), Error> {
    let changed = outcome.changed.clone();
    let is_computed = connection.computes() && !changed.is_empty();
    let is_followed = is_computed && !outcome.is_interrupted();
    let printed = match is_computed && progress.is_json() {
        true => outcome.end(),
        false => print(target, outcome, text::state_line, progress),
    };
    if is_followed {
        watch::watch(connection, changed, progress).await?;
    }
    printed
}

/// Prints the changed experiments, as lines or as JSON, then returns the error about the
/// others.
pub fn print(
    target: &Target,
    outcome: Outcome<Experiment>,
    line: impl Fn(&Experiment) -> String,
    progress: &mut Progress,
) -> Result<(), Error> {
    print_of(target, outcome, |experiment| experiment, line, progress)
}

/// Like [`print()`], for answers that contain an experiment.
pub fn print_of<T>(
    target: &Target,
    outcome: Outcome<T>,
    experiment: impl Fn(&T) -> &Experiment,
    line: impl Fn(&T) -> String,
    progress: &mut Progress,
) -> Result<(), Error> {
    if outcome.changed.is_empty() {
        return outcome.end();
    }
    if progress.is_json() {
        let changed = outcome.changed.iter().map(|change| experiment(change).into()).collect();
        let changed: OneOrMore<ExperimentDocument<'_>> = OneOrMore::about(&target.subject, changed);
        progress.print_document(&changed)?;
    } else {
        let lines: Vec<String> = outcome.changed.iter().map(line).collect();
        progress.print(&lines.join("\n"))?;
    }
    outcome.end()
}

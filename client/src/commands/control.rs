//! `swarmctl pause`, `resume`, `priority` and `cancel`: commands that change the
//! state or the share of an experiment, and print the experiment.

use clap::{Args, value_parser};
use swarm_proto::v1::{
    CancelExperimentRequest, Experiment, PauseExperimentRequest, ResumeExperimentRequest,
    SetPriorityRequest,
};

use super::Remote;
use crate::{
    args::ExperimentId,
    connection::{Connection, present},
    error::Error,
    json,
    progress::Progress,
    text,
};

/// Pause an experiment: workers get no items of it until it is resumed.
///
/// It stays paused when the coordinator restarts; `swarmctl resume` continues it.
/// A pause changes no bit of the results.
#[derive(Debug, Args)]
pub struct PauseArgs {
    #[command(flatten)]
    experiment: ExperimentId,
    /// Reason of the pause; list, logs and explain show it.
    #[arg(long, value_name = "TEXT")]
    reason: Option<String>,
}

impl Remote for PauseArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiment_id = self.experiment.id;
        let reason = self.reason.unwrap_or_default();
        let request = PauseExperimentRequest { experiment_id, reason };
        let response =
            connection.call(async |client| client.pause_experiment(request.clone()).await).await?;
        let experiment = present(response.experiment)?;
        let resume = format!("continue it with: swarmctl resume {experiment_id}");
        print(&experiment, &format!("{}\n{resume}", text::state_line(&experiment)), progress)
    }
}

/// Continue a paused experiment.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

impl Remote for ResumeArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let request = ResumeExperimentRequest { experiment_id: self.experiment.id };
        let response =
            connection.call(async |client| client.resume_experiment(request).await).await?;
        let experiment = present(response.experiment)?;
        print(&experiment, &text::state_line(&experiment), progress)
    }
}

/// Change an experiment's share of the fleet.
///
/// While several experiments have items for the workers, each gets a share of the
/// workers' time in proportion to its priority.
#[derive(Debug, Args)]
pub struct PriorityArgs {
    #[command(flatten)]
    experiment: ExperimentId,
    /// New priority, 1 to 1000; an experiment starts with 100.
    #[arg(value_name = "N", value_parser = value_parser!(u32).range(1..=1000))]
    priority: u32,
}

impl Remote for PriorityArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Self { experiment: ExperimentId { id: experiment_id }, priority } = self;
        let request = SetPriorityRequest { experiment_id, priority };
        let response = connection.call(async |client| client.set_priority(request).await).await?;
        let experiment = present(response.experiment)?;
        let text = format!("{}: priority {}", text::title(&experiment), experiment.priority);
        print(&experiment, &text, progress)
    }
}

/// End an experiment early; its history and champion stay stored.
#[derive(Debug, Args)]
pub struct CancelArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

impl Remote for CancelArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let request = CancelExperimentRequest { experiment_id: self.experiment.id };
        let response =
            connection.call(async |client| client.cancel_experiment(request).await).await?;
        let experiment = present(response.experiment)?;
        print(&experiment, &text::cancelled(&experiment), progress)
    }
}

fn print(experiment: &Experiment, text: &str, progress: &mut Progress) -> Result<(), Error> {
    if progress.is_json() {
        progress.print(&json::document(&json::ExperimentDocument::from(experiment)))
    } else {
        progress.print(text)
    }
}

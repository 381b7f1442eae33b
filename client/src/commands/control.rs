//! The commands that change what becomes of an experiment: `pause`, `resume`,
//! `priority`, `cancel`.

use swarm_proto::v1::Experiment;

use crate::{connection::Connection, error::Error, json, progress::Progress, text};

/// `swarmctl pause`
pub async fn pause(
    connection: &Connection,
    experiment_id: u64,
    reason: Option<String>,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.pause(experiment_id, reason.unwrap_or_default()).await?;
    let resume = format!("go on with: swarmctl resume {experiment_id}");
    print(&experiment, &format!("{}\n{resume}", text::standing(&experiment)), progress)
}

/// `swarmctl resume`
pub async fn resume(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.resume(experiment_id).await?;
    print(&experiment, &text::standing(&experiment), progress)
}

/// `swarmctl priority`
pub async fn set_priority(
    connection: &Connection,
    experiment_id: u64,
    priority: u32,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.set_priority(experiment_id, priority).await?;
    let text = format!("{}: priority {}", text::title(&experiment), experiment.priority);
    print(&experiment, &text, progress)
}

/// `swarmctl cancel`
pub async fn cancel(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.cancel(experiment_id).await?;
    print(&experiment, &text::cancelled(&experiment), progress)
}

fn print(experiment: &Experiment, text: &str, progress: &mut Progress) -> Result<(), Error> {
    if progress.is_json() {
        progress.print(&json::document(&json::ExperimentDocument::from(experiment)))
    } else {
        progress.print(text)
    }
}

//! The state of the whole fleet, and the reasons why its experiments wait.

use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{
    ExperimentState, ExplainExperimentResponse, ListExperimentsRequest, ListWorkersRequest,
    RunningEvaluation,
};

use super::{Explanation, explain};
use crate::{
    clock, connection::Connection, error::Error, finding::Finding, progress::Progress, text,
};

/// The fleet, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Fleet<'a> {
    /// Number of connected workers.
    workers: usize,
    /// Number of their slots, each of which computes one item at a time.
    slots: u64,
    /// The unfinished evaluations.
    evaluations: Vec<Evaluation<'a>>,
    /// The experiments that have not ended.
    experiments: Vec<Explanation<'a>>,
}

/// An unfinished evaluation.
#[derive(Debug, Serialize, JsonSchema)]
struct Evaluation<'a> {
    /// Name of the experiment that it evaluates.
    name: &'a str,
    /// Number of its episodes.
    episodes: u64,
    /// Number of episodes that are not done.
    episodes_left: u64,
    /// Number of items without a worker.
    items_queued: u32,
    /// Number of workers that may compute it.
    workers_available: u32,
    /// Time since its beginning, milliseconds.
    running_ms: u64,
}

impl<'a> From<&'a RunningEvaluation> for Evaluation<'a> {
    fn from(evaluation: &'a RunningEvaluation) -> Self {
        Self {
            name: &evaluation.name,
            episodes: evaluation.episodes,
            episodes_left: evaluation.episodes_left,
            items_queued: evaluation.items_queued,
            workers_available: evaluation.workers_available,
            running_ms: evaluation.running_ms,
        }
    }
}

/// The reason why an evaluation waits, with the next steps.
fn evaluation_lines(
    evaluation: &RunningEvaluation,
    n_workers: usize,
    connection: &Connection,
) -> String {
    let RunningEvaluation { name, episodes, episodes_left, .. } = evaluation;
    let done = episodes.saturating_sub(*episodes_left);
    let time = clock::duration_ms(evaluation.running_ms);
    let queued = text::counted(evaluation.items_queued.into(), "item");
    let mut lines = vec![format!(
        "an evaluation of {name}: {done} of {episodes} episodes done in {time}; {queued} without a \
         worker"
    )];
    if evaluation.workers_available == 0 {
        lines.push(match n_workers {
            0 => "no worker is connected".to_owned(),
            n => format!("none of {} takes it", text::counted(n as u64, "connected worker")),
        });
        if n_workers > 0 {
            lines.push(connection.in_place("  -> see why: swarmctl workers --output wide"));
        }
        lines.push(format!("  -> start some: worker --coordinator {}", connection.address()));
        lines.push("  -> or compute it without workers: swarmctl evaluate --local".to_owned());
    }
    lines.join("\n")
}

/// Explains every unfinished experiment. Prints findings about the whole fleet once.
pub async fn fleet(connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
    let request = ListWorkersRequest {};
    let answer = connection.call_fleet(async |client| client.list_workers(request).await).await?;
    let (workers, evaluations) = (answer.workers, answer.evaluations);
    let slots = workers.iter().map(|worker| u64::from(worker.slots)).sum();
    let mut explained: Vec<(ExplainExperimentResponse, Vec<Finding>)> = Vec::new();
    let states = vec![ExperimentState::Running.into(), ExperimentState::Paused.into()];
    let unfinished = ListExperimentsRequest { states, ..Default::default() };
    for experiment in connection.list(unfinished).await? {
        explained.push(explain(connection, experiment.id).await?);
    }
    if progress.is_json() {
        let experiments = explained.iter().filter_map(|(answer, findings)| {
            Some(Explanation { experiment: answer.experiment.as_ref()?.into(), findings })
        });
        let experiments = experiments.collect();
        return progress.print_document(&Fleet {
            workers: workers.len(),
            slots,
            evaluations: evaluations.iter().map(Into::into).collect(),
            experiments,
        });
    }
    let n_unfinished = match explained.len() {
        0 => "all experiments have ended".to_owned(),
        1 => "1 experiment has not ended".to_owned(),
        n => format!("{n} experiments have not ended"),
    };
    let mut sections = vec![match connection.data_dir() {
        Some(data_dir) => {
            let fleet = text::no_fleet(data_dir, connection.holder().await.as_ref());
            format!("{fleet}\n{n_unfinished}")
        }
        None => format!(
            "{} with {}; {n_unfinished}",
            text::counted(workers.len() as u64, "worker"),
            text::counted(slots, "slot"),
        ),
    }];
    let lines = |evaluation| evaluation_lines(evaluation, workers.len(), connection);
    sections.extend(evaluations.iter().map(lines));
    // Findings about the fleet come from experiments: without any, no workers are needed.
    let mut of_fleet: Vec<String> = Vec::new();
    let mut of_experiments = Vec::new();
    for (answer, findings) in &explained {
        let Some(experiment) = &answer.experiment else { continue };
        let mut lines = vec![text::state_line(experiment)];
        lines.extend(text::eta_line(experiment));
        for finding in findings {
            let finding_text = finding.to_string();
            if !finding.is_of_fleet() {
                lines.push(finding_text);
            } else if !of_fleet.contains(&finding_text) {
                of_fleet.push(finding_text);
            }
        }
        of_experiments.push(lines.join("\n").replace('\n', "\n  "));
    }
    sections.append(&mut of_fleet);
    sections.append(&mut of_experiments);
    progress.print(&sections.join("\n\n"))
}

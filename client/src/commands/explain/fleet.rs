//! What the whole fleet does, and what its experiments wait for.

use serde::Serialize;
use swarm_proto::v1::{ExplainExperimentResponse, ListWorkersRequest};

use super::{Explanation, explain, finding::Finding};
use crate::{
    connection::Connection, error::Error, json, json::has_ended, progress::Progress, text,
};

/// The fleet, as JSON.
#[derive(Debug, Serialize)]
struct Fleet<'a> {
    workers: usize,
    slots: u64,
    experiments: Vec<Explanation<'a>>,
}

/// Explains every experiment that has not ended. What holds for all is said once.
pub async fn fleet(connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
    let request = ListWorkersRequest {};
    let workers =
        connection.call_fleet(async |client| client.list_workers(request).await).await?.workers;
    let slots = workers.iter().map(|worker| u64::from(worker.slots)).sum();
    let mut explained: Vec<(ExplainExperimentResponse, Vec<Finding>)> = Vec::new();
    for experiment in connection.experiments().await? {
        if !has_ended(experiment.state()) {
            explained.push(explain(connection, experiment.id).await?);
        }
    }
    if progress.is_json() {
        let experiments = explained.iter().filter_map(|(answer, findings)| {
            Some(Explanation { experiment: answer.experiment.as_ref()?.into(), findings })
        });
        let experiments = experiments.collect();
        return progress.print(&json::document(&Fleet {
            workers: workers.len(),
            slots,
            experiments,
        }));
    }
    let n_unfinished = match explained.len() {
        1 => "1 experiment has".to_owned(),
        n => format!("{n} experiments have"),
    };
    let mut sections = vec![match connection.data_dir() {
        Some(data_dir) => {
            let fleet = text::no_fleet(data_dir, connection.holder().await.as_ref());
            format!("{fleet}\n{n_unfinished} not ended")
        }
        None => format!(
            "{} with {}; {n_unfinished} not ended",
            text::counted(workers.len() as u64, "worker"),
            text::counted(slots, "slot"),
        ),
    }];
    // With an experiment, what the workers are for is known: only then they may be too few.
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

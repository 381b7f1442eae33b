//! `swarmctl explain`: what an experiment waits for, and the next steps.

pub mod fleet;

use clap::Args;
use clap_complete::ArgValueCompleter;
use model::wire::{has_ended, round_name};
use schemars::JsonSchema;
use serde::Serialize;
use swarm_proto::v1::{
    Event, ExplainExperimentRequest, ExplainExperimentResponse, HeldItems, Round, event::Kind,
};

use crate::{
    clock, complete,
    connection::{Connection, present},
    error::Error,
    finding::{self, Finding, WORKERS_MAX},
    json,
    progress::Progress,
    remote::Remote,
    subject::Subject,
    text,
};

/// What an experiment waits for.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Explanation<'a> {
    experiment: json::ExperimentDocument<'a>,
    /// The most important first.
    findings: &'a [Finding],
}

/// Explain what an experiment or the whole fleet waits for, and the next steps.
///
/// Prints on one screen what the coordinator knows: no workers, paused, queued
/// behind other experiments, waiting at the barrier for the last items of a
/// generation, failing items, a full disk. Each finding comes with its next steps.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// Number or name of the experiment, or name of a group [default: the fleet, with all
    /// experiments that have not ended]
    #[arg(value_name = "ID|NAME", add = ArgValueCompleter::new(complete::experiments))]
    subject: Option<Subject>,
}

impl Remote for ExplainArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let Some(subject) = &self.subject else { return fleet::fleet(connection, progress).await };
        let mut explained = Vec::new();
        for experiment in connection.subject(subject).await? {
            explained.push(explain(connection, experiment.id).await?);
        }
        if progress.is_json() {
            let documents: Vec<Explanation<'_>> = explained
                .iter()
                .filter_map(|(answer, findings)| {
                    Some(Explanation { experiment: answer.experiment.as_ref()?.into(), findings })
                })
                .collect();
            return progress.print_document(&json::OneOrMore::about(subject, documents));
        }
        let mut texts = Vec::new();
        for (answer, findings) in &explained {
            let experiment = present(answer.experiment.clone())?;
            let mut head = vec![text::state_line(&experiment)];
            head.extend(text::eta_line(&experiment));
            let mut sections = vec![head.join("\n")];
            sections.extend(text::origin(&experiment));
            sections.extend(findings.iter().map(Finding::to_string));
            sections.extend(answer.round.as_ref().map(batch_lines));
            sections.extend(notices(answer));
            texts.push(sections.join("\n\n"));
        }
        progress.print(&texts.join("\n\n"))
    }
}

/// The coordinator's explanation of an experiment, and the findings from it.
async fn explain(
    connection: &Connection,
    experiment_id: u64,
) -> Result<(ExplainExperimentResponse, Vec<Finding>), Error> {
    let request = ExplainExperimentRequest { experiment_id };
    let answer = connection.call(async |client| client.explain_experiment(request).await).await;
    let answer = answer.map_err(|error| error.about(experiment_id))?;
    let experiment = present(answer.experiment.clone())?;
    let mut findings = match connection.data_dir() {
        Some(data_dir) if !has_ended(experiment.state()) => {
            vec![finding::in_directory(&experiment, data_dir, connection.holder().await.as_ref())]
        }
        _ => finding::findings(&experiment, &answer, connection.address()),
    };
    findings.iter_mut().for_each(|finding| finding.name_place(connection));
    Ok((answer, findings))
}

fn batch_lines(round: &Round) -> String {
    let mut lines = vec![format!(
        "{}: {} of {} episodes done in {}; {} without a worker",
        round_name(round),
        round.episodes - round.episodes_left.min(round.episodes),
        round.episodes,
        clock::duration_ms(round.running_ms),
        text::counted(round.items_queued.into(), "item"),
    )];
    let mut held: Vec<&HeldItems> = round.held.iter().collect();
    held.sort_by_key(|held| (u64::MAX - held.held_ms, held.worker_id));
    for held in held.iter().take(WORKERS_MAX) {
        lines.push(format!(
            "  {} on {} for {}, last seen {} ago",
            text::counted(held.items.into(), "item"),
            held.worker_name,
            clock::duration_ms(held.held_ms),
            clock::duration_ms(held.silent_ms),
        ));
    }
    if let Some(rest @ [_, ..]) = held.get(WORKERS_MAX..) {
        let n_items = rest.iter().map(|held| u64::from(held.items)).sum();
        let workers = text::counted(rest.len() as u64, "more worker");
        lines.push(format!("  {} on {workers}", text::counted(n_items, "item")));
    }
    lines.join("\n")
}

fn notices(answer: &ExplainExperimentResponse) -> Option<String> {
    let line = |event: &Event| match &event.kind {
        Some(Kind::Notice(notice)) => {
            Some(format!("  {}  {}", clock::utc(event.at_ms), notice.message))
        }
        _ => None,
    };
    let lines: Vec<String> = answer.notices.iter().filter_map(line).collect();
    (!lines.is_empty()).then(|| format!("recent notices:\n{}", lines.join("\n")))
}

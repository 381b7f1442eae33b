//! `swarmctl explain`: what an experiment waits for, and the next steps.

mod finding;

use clap::Args;
use serde::Serialize;
use swarm_proto::v1::{
    Event, ExplainExperimentRequest, ExplainExperimentResponse, HeldItems, Round, event::Kind,
};

use super::Remote;
use crate::{
    args::ExperimentId,
    clock,
    connection::{Connection, present},
    error::Error,
    json,
    progress::Progress,
    text,
};

use self::finding::Finding;

/// Most workers that are listed, so that everything fits one screen.
const WORKERS_MAX: usize = 8;

#[derive(Debug, Serialize)]
struct Explanation<'a> {
    experiment: json::ExperimentDocument<'a>,
    findings: &'a [Finding],
}

/// Explain what an experiment waits for, and what to do about it.
///
/// Prints on one screen what the coordinator knows: no workers, paused, queued
/// behind other experiments, waiting at the barrier for the last items of a
/// generation, failing items, a full disk; and for each the next steps.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

impl Remote for ExplainArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let request = ExplainExperimentRequest { experiment_id: self.experiment.id };
        let answer =
            connection.call(async |client| client.explain_experiment(request).await).await?;
        let experiment = present(answer.experiment.clone())?;
        let findings = finding::findings(&experiment, &answer, connection.address());
        progress.print(&if progress.is_json() {
            json::document(&Explanation { experiment: (&experiment).into(), findings: &findings })
        } else {
            let mut sections = vec![text::state_line(&experiment)];
            sections.extend(findings.iter().map(Finding::to_string));
            sections.extend(answer.round.as_ref().map(batch_lines));
            sections.extend(notices(&answer));
            sections.join("\n\n")
        })
    }
}

/// What a batch evaluates: "generation 12", or the champion after it.
fn batch_name(round: &Round) -> String {
    let generation = round.generation;
    if round.judgement {
        format!("the judgement of the champion after generation {generation}")
    } else if round.held_out {
        format!("the re-evaluation of candidates for the champion after generation {generation}")
    } else {
        format!("generation {generation}")
    }
}

fn batch_lines(round: &Round) -> String {
    let mut lines = vec![format!(
        "{}: {} of {} episodes done in {}; {} without a worker",
        batch_name(round),
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

//! What pages get, as JSON.

use std::collections::BTreeMap;

use experiment_file::Seed;
use serde::Serialize;
use serde_json::{Value, json};
use swarm_proto::v1::{
    CompletedGeneration, Event, Experiment, ExperimentState, Worker, event::Kind,
};

use crate::source::Assignment;

/// An experiment in a list.
#[derive(Debug, Serialize)]
pub struct ExperimentAnswer {
    id: u64,
    name: String,
    state: &'static str,
    reason: String,
    generations_done: u64,
    generations: u64,
    seed: Seed,
    algorithm: String,
    population_size: u32,
    genotype_len: u32,
    submitted_at_ms: u64,
    best: Option<f64>,
    mean: Option<f64>,
    /// On trials that selected nothing.
    champion: Option<f64>,
    /// On the trials by which it was selected.
    selection: Option<f64>,
    priority: u32,
    digest: String,
    simulation: String,
    group: String,
    variant: String,
    forked_from: Option<String>,
    last_sequence: u64,
    labels: BTreeMap<String, String>,
    archived: bool,
    /// Mean time of its latest generations.
    generation_ms: Option<f64>,
}

impl ExperimentAnswer {
    /// `has_coordinator`: whether one is there that could be computing it. Otherwise only the
    /// files are known, which call running whatever has not ended.
    pub fn new(it: Experiment, has_coordinator: bool) -> Self {
        Self {
            state: match it.state() {
                ExperimentState::Running if !has_coordinator => "unfinished",
                known => state(known),
            },
            id: it.id,
            name: it.name,
            reason: it.reason,
            generations_done: it.generations_done,
            generations: it.generations,
            seed: Seed(it.seed),
            algorithm: it.algorithm,
            population_size: it.population_size,
            genotype_len: it.genotype_len,
            submitted_at_ms: it.submitted_at_ms,
            best: it.latest.as_ref().map(|latest| latest.best),
            mean: it.latest.as_ref().map(|latest| latest.mean),
            champion: it.champion_fitness,
            selection: it.champion_selection_fitness,
            priority: it.priority,
            digest: it.digest,
            simulation: it.simulation,
            group: it.group,
            variant: it.variant,
            forked_from: it.forked_from.map(|it| format!("{}@{}", it.experiment_id, it.generation)),
            last_sequence: it.last_sequence,
            labels: it.labels,
            archived: it.archived,
            generation_ms: it.recent_generation_ms.map(f64::round),
        }
    }
}

/// The name of a state.
pub fn state(state: ExperimentState) -> &'static str {
    match state {
        ExperimentState::Unspecified => "unknown",
        ExperimentState::Running => "running",
        ExperimentState::Completed => "completed",
        ExperimentState::Failed => "failed",
        ExperimentState::Cancelled => "cancelled",
        ExperimentState::Paused => "paused",
    }
}

/// A generation as a row of a chart: number, best, mean, min, standard deviation, duration
/// in ms, episodes, time of completion in ms since 1970 UTC.
pub type GenerationRow = (u64, f64, f64, f64, f64, u64, u64, u64);

/// A generation; none if the message is incomplete.
pub fn generation_row(completed: &CompletedGeneration) -> Option<GenerationRow> {
    let it = completed.summary.as_ref()?;
    Some((
        it.generation,
        it.best,
        it.mean,
        it.min,
        it.standard_deviation,
        it.duration_ms,
        it.episodes,
        completed.completed_at_ms,
    ))
}

/// An event that is no generation.
#[derive(Debug, Serialize)]
pub struct EventAnswer {
    sequence: u64,
    at_ms: u64,
    text: String,
}

/// An event that is no generation.
pub fn event(event: Event) -> Option<EventAnswer> {
    let text = match event.kind? {
        Kind::GenerationCompleted(_) => return None,
        Kind::StateChanged(change) if change.reason.is_empty() => state(change.state()).to_owned(),
        Kind::StateChanged(change) => format!("{}: {}", state(change.state()), change.reason),
        Kind::Notice(notice) => notice.message,
    };
    Some(EventAnswer { sequence: event.sequence, at_ms: event.at_ms, text })
}

/// A worker.
#[derive(Debug, Serialize)]
pub struct WorkerAnswer {
    id: u64,
    name: String,
    version: String,
    slots: u32,
    items: u32,
    results_per_second: f64,
    idle_share: f64,
    connected_at_ms: u64,
    last_heard_at_ms: u64,
    /// Empty: it works.
    trouble: String,
}

impl From<Worker> for WorkerAnswer {
    fn from(it: Worker) -> Self {
        let trouble = match (it.distrusted, it.waits, it.draining) {
            (why, _, _) if !why.is_empty() => format!("in quarantine: {why}"),
            (_, why, _) if !why.is_empty() => why,
            (_, _, true) => "finishes and leaves".to_owned(),
            _ => String::new(),
        };
        Self {
            id: it.id,
            name: it.name,
            version: it.version,
            slots: it.slots,
            items: it.items_in_flight,
            results_per_second: it.results_per_second,
            idle_share: it.idle_share,
            connected_at_ms: it.connected_at_ms,
            last_heard_at_ms: it.last_heard_at_ms,
            trouble,
        }
    }
}

/// Assignments as rows, which name their workers and batches by place: worker, batch,
/// individual, first trial, trial after the last, time since it was given, time since its end
/// (or 0) and time of computing in µs, fate.
pub fn timeline(assignments: Vec<Assignment>) -> Value {
    let mut workers: BTreeMap<(u64, String), usize> = BTreeMap::new();
    let mut batches: BTreeMap<(String, Option<u64>), usize> = BTreeMap::new();
    let mut rows = Vec::with_capacity(assignments.len());
    for it in assignments {
        let n = workers.len();
        let worker = *workers.entry((it.worker_id, it.worker_name)).or_insert(n);
        let n = batches.len();
        let batch = *batches.entry((it.batch, it.experiment)).or_insert(n);
        let [given, ended, busy] =
            [it.assigned_for, it.ended_for, it.busy].map(|it| it.as_micros() as u64);
        let (first, end) = (it.trials.start, it.trials.end);
        rows.push(json!([worker, batch, it.individual, first, end, given, ended, busy, it.fate]));
    }
    json!({ "workers": by_place(workers), "batches": by_place(batches), "assignments": rows })
}

fn by_place<T: Ord>(places: BTreeMap<T, usize>) -> Vec<T> {
    let mut all: Vec<(usize, T)> = places.into_iter().map(|(it, place)| (place, it)).collect();
    all.sort_by_key(|(place, _)| *place);
    all.into_iter().map(|(_, it)| it).collect()
}

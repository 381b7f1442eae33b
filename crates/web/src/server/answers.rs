//! The answers to pages, as JSON.

use std::collections::BTreeMap;

use engine::{Fate, TimelineEntry};
use experiment_file::Seed;
use model::wire::state_name;
use serde::Serialize;
use serde_json::{Value, json};
use swarm_proto::v1::{
    CompletedGeneration, Event, Experiment, ExperimentState, Worker, event::Kind,
};

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
    /// Fitness of the champion on trials that selected nothing.
    champion: Option<f64>,
    /// Fitness of the champion on the trials that selected it.
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
    /// `has_coordinator`: whether a coordinator could be computing it. Without one, the files
    /// call every unfinished experiment running.
    pub fn new(experiment: Experiment, has_coordinator: bool) -> Self {
        Self {
            state: match experiment.state() {
                ExperimentState::Running if !has_coordinator => "unfinished",
                known => state_name(known),
            },
            id: experiment.id,
            name: experiment.name,
            reason: experiment.reason,
            generations_done: experiment.generations_done,
            generations: experiment.generations,
            seed: Seed(experiment.seed),
            algorithm: experiment.algorithm,
            population_size: experiment.population_size,
            genotype_len: experiment.genotype_len,
            submitted_at_ms: experiment.submitted_at_ms,
            best: experiment.latest.as_ref().map(|latest| latest.best),
            mean: experiment.latest.as_ref().map(|latest| latest.mean),
            champion: experiment.champion_fitness,
            selection: experiment.champion_selection_fitness,
            priority: experiment.priority,
            digest: experiment.digest,
            simulation: experiment.simulation,
            group: experiment.group,
            variant: experiment.variant,
            forked_from: experiment
                .forked_from
                .map(|origin| format!("{}@{}", origin.experiment_id, origin.generation)),
            last_sequence: experiment.last_sequence,
            labels: experiment.labels,
            archived: experiment.archived,
            generation_ms: experiment.recent_generation_ms.map(f64::round),
        }
    }
}

/// A generation as a row of a chart, without keys because a page gets thousands: number, best,
/// mean, min, standard deviation, duration in ms, episodes, time of completion in ms since 1970
/// UTC. `generation-row.js` names the columns.
pub type GenerationRow = (u64, f64, f64, f64, f64, u64, u64, u64);

/// A generation; none if the message is incomplete.
pub fn generation_row(completed: &CompletedGeneration) -> Option<GenerationRow> {
    let summary = completed.summary.as_ref()?;
    Some((
        summary.generation,
        summary.best,
        summary.mean,
        summary.min,
        summary.standard_deviation,
        summary.duration_ms,
        summary.episodes,
        completed.completed_at_ms,
    ))
}

/// An event other than a generation.
#[derive(Debug, Serialize)]
pub struct EventAnswer {
    sequence: u64,
    at_ms: u64,
    text: String,
}

/// An event other than a generation.
pub fn event(event: Event) -> Option<EventAnswer> {
    let text = match event.kind? {
        Kind::GenerationCompleted(_) => return None,
        Kind::StateChanged(change) if change.reason.is_empty() => {
            state_name(change.state()).to_owned()
        }
        Kind::StateChanged(change) => format!("{}: {}", state_name(change.state()), change.reason),
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
    fn from(worker: Worker) -> Self {
        let trouble = match (worker.distrusted, worker.waits, worker.draining) {
            (why, _, _) if !why.is_empty() => format!("in quarantine: {why}"),
            (_, why, _) if !why.is_empty() => why,
            (_, _, true) => "finishes and leaves".to_owned(),
            _ => String::new(),
        };
        Self {
            id: worker.id,
            name: worker.name,
            version: worker.version,
            slots: worker.slots,
            items: worker.items_in_flight,
            results_per_second: worker.results_per_second,
            idle_share: worker.idle_share,
            connected_at_ms: worker.connected_at_ms,
            last_heard_at_ms: worker.last_heard_at_ms,
            trouble,
        }
    }
}

/// Assignments as rows, which name their workers and batches by place: worker, batch,
/// individual, first trial, trial after the last, time since it was given, time since its end
/// (or 0) and time of computing in µs, fate.
pub fn timeline(entries: Vec<TimelineEntry>) -> Value {
    let mut workers: BTreeMap<(u64, String), usize> = BTreeMap::new();
    let mut batches: BTreeMap<(String, Option<u64>), usize> = BTreeMap::new();
    let mut rows = Vec::with_capacity(entries.len());
    for entry in entries {
        let n = workers.len();
        let worker = *workers.entry((entry.worker.0, entry.name.to_string())).or_insert(n);
        let n = batches.len();
        let experiment = entry.job.experiment().map(|id| id.0);
        let batch = *batches.entry((entry.batch(), experiment)).or_insert(n);
        let [given, ended, busy] = [entry.assigned_for, entry.ended_for, entry.busy]
            .map(|duration| duration.as_micros() as u64);
        let (first, end) = (entry.trials.start, entry.trials.end);
        let fate = match entry.fate {
            Fate::Unanswered => "unanswered",
            Fate::Computed => "computed",
            Fate::TakenBack => "taken-back",
            Fate::Failed => "failed",
            Fate::Lost => "lost",
        };
        rows.push(json!([worker, batch, entry.individual, first, end, given, ended, busy, fate]));
    }
    json!({ "workers": by_place(workers), "batches": by_place(batches), "assignments": rows })
}

fn by_place<T: Ord>(places: BTreeMap<T, usize>) -> Vec<T> {
    let mut all: Vec<(usize, T)> = places.into_iter().map(|(item, place)| (place, item)).collect();
    all.sort_by_key(|(place, _)| *place);
    all.into_iter().map(|(_, item)| item).collect()
}

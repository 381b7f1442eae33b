//! Records the recent work of every worker: a limited number of ended assignments, and all that
//! have not ended.

use std::{collections::VecDeque, ops::Range, sync::Arc, time::Duration};

use model::ids::{JobId, WorkerId};
use sim_core::TrialSet;

use super::{Engine, Instant, batch::name_of, in_flight::AssignedItem, worker::Worker};

/// Number of ended assignments to keep.
const ENDED_MAX: usize = 2048;
/// Number of failed and lost assignments to keep as well: they are rare, and people look for them.
const BROKEN_MAX: usize = 256;
/// Most unanswered assignments in one timeline; the oldest come first.
const UNANSWERED_MAX: usize = 2048;

/// The outcome of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The worker has it, and has not answered.
    Unanswered,
    /// The worker has returned its values.
    Computed,
    /// The engine took it back: it no longer needed the result, or had another worker compute it.
    TakenBack,
    /// The worker reported that it cannot be computed.
    Failed,
    /// The worker left, was lost, or fell silent.
    Lost,
}

/// An assignment, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct TimelineEntry {
    /// The connection of the worker that had it.
    pub worker: WorkerId,
    /// The worker's name.
    pub name: Arc<str>,
    /// Its job.
    pub job: JobId,
    /// The trial set of its batch.
    pub trial_set: TrialSet,
    /// Index of the individual among the batch's genotypes.
    pub individual: u32,
    /// The trials.
    pub trials: Range<u32>,
    /// Time since its assignment.
    pub assigned_for: Duration,
    /// Time since its end; zero if it has not ended.
    pub ended_for: Duration,
    /// The worker's computing time; zero without a result.
    pub busy: Duration,
    /// Its outcome.
    pub fate: Fate,
}

/// An assignment that has ended.
#[derive(Debug)]
struct Ended {
    worker: WorkerId,
    name: Arc<str>,
    item: AssignedItem,
    at: Instant,
    busy: Duration,
    fate: Fate,
}

/// The assignments that ended last.
#[derive(Debug, Default)]
pub struct Timeline {
    ended: VecDeque<Ended>,
    broken: VecDeque<Ended>,
}

impl Timeline {
    /// Records an ended assignment. `busy`: its computing time.
    pub fn add(
        &mut self,
        now: Instant,
        (id, worker): (WorkerId, &Worker),
        item: AssignedItem,
        fate: Fate,
        busy: Duration,
    ) {
        let name = Arc::clone(worker.name());
        let (list, n_max) = match fate {
            Fate::Failed | Fate::Lost => (&mut self.broken, BROKEN_MAX),
            _ => (&mut self.ended, ENDED_MAX),
        };
        if list.len() == n_max {
            list.pop_front();
        }
        list.push_back(Ended { worker: id, name, item, at: now, busy, fate });
    }
}

impl TimelineEntry {
    /// The name of its batch in messages.
    pub fn batch(&self) -> String {
        format!("{}, {}", self.job, name_of(self.trial_set))
    }
}

impl Engine {
    /// The recent assignments. Failed and lost ones are kept for longest.
    pub fn timeline(&self, now: Instant) -> Vec<TimelineEntry> {
        let Timeline { ended, broken } = &self.timeline;
        let of_ended = |ended: &Ended| {
            let ended_for = now.saturating_duration_since(ended.at);
            entry(now, (ended.worker, &ended.name), &ended.item, ended_for, ended.busy, ended.fate)
        };
        let mut unanswered: Vec<(WorkerId, &Worker, &AssignedItem)> = self
            .workers
            .iter()
            .flat_map(|(&id, worker)| {
                let items = worker.in_flight.values().chain(worker.written_off.values());
                items.map(move |item| (id, worker, item))
            })
            .collect();
        unanswered.sort_by_key(|&(.., item)| item.assigned);
        let unanswered = unanswered.into_iter().take(UNANSWERED_MAX).map(|(id, worker, item)| {
            let who = (id, worker.name());
            entry(now, who, item, Duration::ZERO, Duration::ZERO, Fate::Unanswered)
        });
        broken.iter().chain(ended).map(of_ended).chain(unanswered).collect()
    }
}

fn entry(
    now: Instant,
    (worker, name): (WorkerId, &Arc<str>),
    item: &AssignedItem,
    ended_for: Duration,
    busy: Duration,
    fate: Fate,
) -> TimelineEntry {
    TimelineEntry {
        worker,
        name: Arc::clone(name),
        job: item.job,
        trial_set: item.trial_set,
        individual: item.item.individual,
        trials: item.item.trials.clone(),
        assigned_for: now.saturating_duration_since(item.assigned),
        ended_for,
        busy,
        fate,
    }
}

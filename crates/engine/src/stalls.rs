//! Finds workers that send heartbeats but no results.

use std::time::Duration;

use model::ids::WorkerId;

use super::{Engine, Instant, results::NoResult, worker::Worker};

/// A worker is stalled if its oldest item takes this many times its expected duration, plus this
/// time.
const PATIENCE: (u32, Duration) = (4, Duration::from_secs(1));
/// The same for an audit that no other worker can do. The engine would have to waive it.
const PATIENCE_WITH_AUDITOR: (u32, Duration) = (40, Duration::from_secs(10));

impl Engine {
    /// Gives the items of stalled workers to others.
    pub(super) fn write_off_stalled(&mut self, now: Instant) {
        let mut idle = self
            .workers
            .iter()
            .filter(|(_, worker)| worker.availability().is_usable() && worker.in_flight.is_empty());
        let has_idle = idle.next().is_some();
        let mut latest: Vec<(Instant, WorkerId)> = self
            .workers
            .iter()
            .filter_map(|(&id, worker)| worker.last_result.map(|at| (at, id)))
            .collect();
        if latest.is_empty() {
            return;
        }
        let n = latest.len().min(2);
        latest.select_nth_unstable_by_key(n - 1, |&latest| std::cmp::Reverse(latest));
        latest.truncate(n);
        // Idle workers count, too: they could have returned something.
        let others_since =
            |id, since| has_idle || latest.iter().any(|&(at, other)| other != id && at > since);
        let stalled: Vec<WorkerId> = self
            .workers
            .iter()
            .filter(|&(&id, worker)| {
                let deadline = self.deadline(id, worker);
                deadline.is_some_and(|(since, until)| until < now && others_since(id, since))
            })
            .map(|(&id, _)| id)
            .collect();
        for id in stalled {
            self.write_off(now, id);
        }
    }

    /// The time of a worker's last progress, and the deadline after which the worker counts as
    /// stalled.
    fn deadline(&self, id: WorkerId, worker: &Worker) -> Option<(Instant, Instant)> {
        let (_, oldest) = worker.in_flight.first_key_value()?;
        let since = worker.last_result.map_or(oldest.assigned, |at| at.max(oldest.assigned));
        let work = &self.jobs[&oldest.job];
        let takes = work.expected(oldest.item.trials.len(), worker.pace)?;
        let first = work.batch.as_ref()?.computed_by(&oldest.item);
        let mut others = self.workers.iter().filter(|&(&other, _)| other != id);
        let is_auditor = |other: &Worker| {
            other.availability().is_usable() && other.takes(work) && Some(other.name()) != first
        };
        let (times, more) = if oldest.is_audit() && !others.any(|(_, other)| is_auditor(other)) {
            PATIENCE_WITH_AUDITOR
        } else {
            PATIENCE
        };
        Some((since, since + takes * times + more))
    }

    /// Marks a worker as stalled: it gets no items until it returns a result. The engine takes
    /// its waiting items back, and gives duplicates of its items in progress to others.
    fn write_off(&mut self, now: Instant, id: WorkerId) {
        self.counters.n_workers_stalled += 1;
        self.update_worker(id, |worker| worker.obstacles.is_stalled = true);
        let worker = &self.workers[&id];
        let n_computing = worker.in_flight.len() - worker.n_waiting();
        let in_flight: Vec<_> = worker.in_flight.keys().copied().collect();
        for (age_rank, assignment_id) in in_flight.into_iter().enumerate().rev() {
            let assignment = if age_rank < n_computing {
                self.take_assignment(id, assignment_id).inspect(|assignment| {
                    let copy = assignment.clone();
                    self.update_worker(id, |worker| worker.written_off.insert(assignment_id, copy));
                })
            } else {
                self.recall(now, id, assignment_id)
            };
            if let Some(assignment) = assignment {
                self.on_no_result(now, assignment, NoResult::TakenBack);
            }
        }
        self.finish_evaluated(now);
    }
}

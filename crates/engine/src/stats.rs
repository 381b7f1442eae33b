//! Statistics of the engine's past and pending work.

use model::ids::JobId;

use super::{Engine, Instant, availability::Availability, batch::BatchInProgress};

/// Counts of events since the engine began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Workers that joined; a worker that reconnects counts again.
    pub n_workers_joined: u64,
    /// Workers that announced that they leave, and left.
    pub n_workers_left: u64,
    /// Workers that left without announcing it, or were dropped.
    pub n_workers_lost: u64,
    /// Assignments to workers.
    pub n_items_assigned: u64,
    /// Items that workers returned values for, needed or not.
    pub n_items_computed: u64,
    /// Items that a worker could not compute.
    pub n_items_failed: u64,
    /// Assignments that ended without a result because their worker left, was lost, stalled, went
    /// into quarantine, or failed while in doubt. Audits count, too.
    pub n_items_requeued: u64,
    /// Items taken back from a worker because another has the result, or a free slot.
    pub n_items_recalled: u64,
    /// Trials whose fitness became known.
    pub n_episodes: u64,
    /// Workers that were proved faulty.
    pub n_workers_quarantined: u64,
    /// How often a worker returned nothing for a long time while others did.
    pub n_workers_stalled: u64,
    /// Questions for the referee.
    pub n_questions: u64,
}

/// Statistics of the fleet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FleetStats {
    /// Counts of past events.
    pub counters: Counters,
    /// Connected workers that get items.
    pub n_workers_available: usize,
    /// Connected workers that want no more items.
    pub n_workers_draining: usize,
    /// Connected workers that get nothing for a while.
    pub n_workers_waiting: usize,
    /// Connected workers in quarantine.
    pub n_workers_quarantined: usize,
    /// Slots of all connected workers.
    pub n_slots: usize,
    /// Time that slots have existed, summed over slots, s.
    pub slot_time_s: f64,
    /// Part of `slot_time_s` that led to results, s.
    pub busy_time_s: f64,
}

/// Statistics of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct JobStats {
    /// Whether it is paused.
    pub is_paused: bool,
    /// Items that wait for a worker; none while it is paused.
    pub n_items_queued: usize,
    /// Items that workers have; every duplicate of an item counts.
    pub n_items_in_flight: usize,
    /// Trials whose results became known since the job started in this engine.
    pub n_episodes: u64,
}

impl Engine {
    /// Statistics of the fleet.
    pub fn fleet_stats(&self, now: Instant) -> FleetStats {
        let mut fleet_time = self.fleet_time;
        fleet_time.advance(now);
        let [mut n_available, mut n_draining, mut n_waiting, mut n_quarantined] = [0; 4];
        for worker in self.workers.values() {
            *match worker.availability() {
                Availability::Free | Availability::OnProbation => &mut n_available,
                Availability::Draining => &mut n_draining,
                Availability::Quarantined(_) => &mut n_quarantined,
                Availability::Stalled | Availability::Doubted | Availability::Resting(_) => {
                    &mut n_waiting
                }
            } += 1;
        }
        FleetStats {
            counters: Counters { n_questions: self.trust.questions.n_asked(), ..self.counters },
            n_workers_available: n_available,
            n_workers_draining: n_draining,
            n_workers_waiting: n_waiting,
            n_workers_quarantined: n_quarantined,
            n_slots: fleet_time.n_slots(),
            slot_time_s: fleet_time.capacity_s(),
            busy_time_s: fleet_time.busy_s(),
        }
    }

    /// Statistics of a job; zeros if it has ended.
    pub fn job_stats(&self, id: JobId) -> JobStats {
        let Some(work) = self.jobs.get(&id) else { return JobStats::default() };
        let count = |number: fn(&BatchInProgress) -> usize| work.batch.as_ref().map_or(0, number);
        JobStats {
            is_paused: work.is_paused,
            n_items_queued: if work.is_paused { 0 } else { count(BatchInProgress::n_waiting) },
            n_items_in_flight: count(BatchInProgress::n_in_flight),
            n_episodes: work.n_episodes,
        }
    }
}

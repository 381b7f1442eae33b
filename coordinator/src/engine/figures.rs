//! What the engine has done, and what it has to do, as numbers.

use std::time::Instant;

use crate::ids::ExperimentId;

use super::{Engine, generation::GenerationInProgress};

/// What has happened since the engine began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Workers that joined; one that comes back counts again.
    pub n_workers_joined: u64,
    /// Workers that left after they had said so.
    pub n_workers_left: u64,
    /// Workers that left otherwise, or were dropped.
    pub n_workers_lost: u64,
    /// Items given to workers.
    pub n_items_assigned: u64,
    /// Items that gave fitness, wanted or not.
    pub n_items_computed: u64,
    /// Items that a worker could not compute.
    pub n_items_failed: u64,
    /// Items that were given back, or taken away from a worker that is lost or not
    /// trusted, without a result.
    pub n_items_requeued: u64,
    /// Items taken back from a worker because another has the result, or has time.
    pub n_items_recalled: u64,
    /// Trials whose fitness became known.
    pub n_episodes: u64,
}

/// The fleet in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FleetFigures {
    /// What has happened.
    pub tally: Tally,
    /// Connected workers that are given work.
    pub n_workers_available: usize,
    /// Connected workers that want no more.
    pub n_workers_draining: usize,
    /// Connected workers whose results are in doubt.
    pub n_workers_distrusted: usize,
    /// Slots of all connected workers.
    pub n_slots: usize,
    /// Time that slots have existed, s.
    pub slot_time_s: f64,
    /// Part of it that went into results, s.
    pub busy_time_s: f64,
}

/// An experiment's work in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WorkFigures {
    /// Whether it waits to be resumed.
    pub is_paused: bool,
    /// Items that wait for a worker; none while it is paused.
    pub n_items_queued: usize,
    /// Items that workers have; an item that several compute counts as many times.
    pub n_items_in_flight: usize,
    /// Trials whose fitness became known since the engine has known the experiment.
    pub n_episodes: u64,
}

impl Engine {
    /// The fleet in numbers.
    pub fn fleet_figures(&self, now: Instant) -> FleetFigures {
        let mut fleet_time = self.fleet_time;
        fleet_time.advance(now);
        let n_draining = self.workers.values().filter(|worker| worker.is_draining).count();
        let n_available = self.workers.values().filter(|worker| worker.is_usable()).count();
        FleetFigures {
            tally: Tally { n_items_assigned: self.n_items_assigned, ..self.tally },
            n_workers_available: n_available,
            n_workers_draining: n_draining,
            n_workers_distrusted: self.workers.len() - n_available - n_draining,
            n_slots: fleet_time.n_slots(),
            slot_time_s: fleet_time.capacity_s(),
            busy_time_s: fleet_time.busy_s(),
        }
    }

    /// An experiment's work in numbers; zeros if it has ended.
    pub fn work_figures(&self, id: ExperimentId) -> WorkFigures {
        let Some(work) = self.experiments.get(&id) else { return WorkFigures::default() };
        let count = |of: fn(&GenerationInProgress) -> usize| work.generation.as_ref().map_or(0, of);
        WorkFigures {
            is_paused: work.is_paused,
            n_items_queued: if work.is_paused { 0 } else { count(GenerationInProgress::n_waiting) },
            n_items_in_flight: count(GenerationInProgress::n_in_flight),
            n_episodes: work.n_episodes,
        }
    }
}

//! Statistics of a worker's past and present work; no decision depends on them.

use std::{
    sync::atomic::{
        AtomicBool, AtomicU64, AtomicUsize,
        Ordering::{Relaxed, SeqCst},
    },
    time::Duration,
};

/// A worker's work since its start, and its present work. Any thread may update or read it at any
/// time.
#[derive(Debug, Default)]
pub struct Stats {
    is_connected: AtomicBool,
    n_connections: AtomicU64,
    n_connections_failed: AtomicU64,
    n_items_computed: AtomicU64,
    n_items_failed: AtomicU64,
    n_items_dropped: AtomicU64,
    n_episodes: AtomicU64,
    n_robot_steps: AtomicU64,
    busy_ns: AtomicU64,
    longest_item_ns: AtomicU64,
    n_items_queued: AtomicUsize,
    n_slots_busy: AtomicUsize,
}

/// The outcome of an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Made {
    /// Results of `n_episodes` episodes.
    Fitness { n_episodes: u64 },
    /// It cannot be computed.
    Failure,
    /// It was cancelled.
    Nothing,
}

/// [`Stats`] at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StatsSnapshot {
    /// Whether it has a session with the coordinator.
    pub is_connected: bool,
    /// Number of streams that the coordinator welcomed.
    pub n_connections: u64,
    /// Number of failed attempts to connect.
    pub n_connections_failed: u64,
    /// Number of items with results.
    pub n_items_computed: u64,
    /// Number of items that could not be computed.
    pub n_items_failed: u64,
    /// Number of items that the coordinator took back during their computation.
    pub n_items_dropped: u64,
    /// Number of episodes of all items with results.
    pub n_episodes: u64,
    /// Environment steps of these episodes, summed over robots.
    pub n_robot_steps: u64,
    /// Computing time, summed over slots.
    pub busy: Duration,
    /// Duration of the longest item so far.
    pub longest_item: Duration,
    /// Number of items that wait for a slot.
    pub n_items_queued: usize,
    /// Number of slots that compute.
    pub n_slots_busy: usize,
}

impl Stats {
    /// The present numbers.
    pub fn snapshot(&self) -> StatsSnapshot {
        StatsSnapshot {
            is_connected: self.is_connected.load(SeqCst),
            n_connections: self.n_connections.load(Relaxed),
            n_connections_failed: self.n_connections_failed.load(Relaxed),
            n_items_computed: self.n_items_computed.load(Relaxed),
            n_items_failed: self.n_items_failed.load(Relaxed),
            n_items_dropped: self.n_items_dropped.load(Relaxed),
            n_episodes: self.n_episodes.load(Relaxed),
            n_robot_steps: self.n_robot_steps.load(Relaxed),
            busy: Duration::from_nanos(self.busy_ns.load(Relaxed)),
            longest_item: Duration::from_nanos(self.longest_item_ns.load(Relaxed)),
            n_items_queued: self.n_items_queued.load(Relaxed),
            n_slots_busy: self.n_slots_busy.load(Relaxed),
        }
    }

    pub(crate) fn on_connected(&self) {
        self.n_connections.fetch_add(1, Relaxed);
        self.is_connected.store(true, SeqCst);
    }

    pub(crate) fn on_disconnected(&self) {
        self.is_connected.store(false, SeqCst);
    }

    pub(crate) fn on_connection_failed(&self) {
        self.n_connections_failed.fetch_add(1, Relaxed);
    }

    pub(crate) fn on_queue(&self, n_queued: usize, n_running: usize) {
        self.n_items_queued.store(n_queued, Relaxed);
        self.n_slots_busy.store(n_running, Relaxed);
    }

    pub(crate) fn on_item(&self, made: Made, busy: Duration) {
        self.busy_ns.fetch_add(busy.as_nanos() as u64, Relaxed);
        self.longest_item_ns.fetch_max(busy.as_nanos() as u64, Relaxed);
        match made {
            Made::Fitness { n_episodes } => {
                self.n_episodes.fetch_add(n_episodes, Relaxed);
                self.n_items_computed.fetch_add(1, Relaxed)
            }
            Made::Failure => self.n_items_failed.fetch_add(1, Relaxed),
            Made::Nothing => self.n_items_dropped.fetch_add(1, Relaxed),
        };
    }

    pub(crate) fn add_robot_steps(&self, n: u64) {
        self.n_robot_steps.fetch_add(n, Relaxed);
    }
}

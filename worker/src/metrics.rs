//! The worker's metrics, and their values at a scrape. A test writes
//! the list in `docs/metrics.md`.

use sim_core::Isa;
use swarm_telemetry::{Metric, Scrape, metrics};

use crate::stats::StatsSnapshot;

metrics! {
    BUILD = Gauge "swarm_worker_build_info" ["version", "fingerprint", "isa"]
        "1; the labels say which release runs, with which simulation, and with which vector instructions.";
    NAME = Gauge "swarm_worker_info" ["name"]
        "1; the label is the worker's name in the coordinator's log.";
    CONNECTED = Gauge "swarm_worker_connected" []
        "1 while it is connected to the coordinator, or 0.";
    CONNECTIONS = Counter "swarm_worker_connections_total" []
        "Connections that the coordinator welcomed; all but the first are reconnections.";
    CONNECTIONS_FAILED = Counter "swarm_worker_connections_failed_total" []
        "Attempts to connect that failed.";
    SLOTS = Gauge "swarm_worker_slots" []
        "Items computed at the same time.";
    SLOTS_BUSY = Gauge "swarm_worker_slots_busy" []
        "Slots that are computing.";
    ITEMS_QUEUED = Gauge "swarm_worker_items_queued" []
        "Items that wait for a slot.";
    ITEMS = Counter "swarm_worker_items_total" ["outcome"]
        "Finished items: computed, failed, or dropped because the coordinator took them back.";
    EPISODES = Counter "swarm_worker_episodes_total" []
        "Episodes of the computed items.";
    ROBOT_STEPS = Counter "swarm_worker_robot_steps_total" []
        "Environment steps of those episodes, summed over robots.";
    BUSY = Counter "swarm_worker_busy_seconds_total" []
        "Time that slots have computed, summed over slots.";
}

/// The constant properties of a worker.
#[derive(Debug, Clone)]
pub struct Identity {
    /// Its name.
    pub name: String,
    /// Number of items that it computes at the same time.
    pub slots: usize,
    /// Its vector instructions.
    pub isa: Isa,
}

/// All values in Prometheus' text format.
pub fn scrape(identity: &Identity, snapshot: &StatsSnapshot) -> String {
    let mut scrape = Scrape::default();
    let isa = identity.isa.to_string();
    scrape.put(&BUILD, &[env!("CARGO_PKG_VERSION"), sim_core::FINGERPRINT, &isa], 1.0);
    scrape.put(&NAME, &[&identity.name], 1.0);
    for (outcome, n_items) in [
        ("computed", snapshot.n_items_computed),
        ("failed", snapshot.n_items_failed),
        ("dropped", snapshot.n_items_dropped),
    ] {
        scrape.put(&ITEMS, &[outcome], n_items as f64);
    }
    let values: [(&Metric, f64); 9] = [
        (&CONNECTED, if snapshot.is_connected { 1.0 } else { 0.0 }),
        (&CONNECTIONS, snapshot.n_connections as f64),
        (&CONNECTIONS_FAILED, snapshot.n_connections_failed as f64),
        (&SLOTS, identity.slots as f64),
        (&SLOTS_BUSY, snapshot.n_slots_busy as f64),
        (&ITEMS_QUEUED, snapshot.n_items_queued as f64),
        (&EPISODES, snapshot.n_episodes as f64),
        (&ROBOT_STEPS, snapshot.n_robot_steps as f64),
        (&BUSY, snapshot.busy.as_secs_f64()),
    ];
    for (metric, value) in values {
        scrape.put(metric, &[], value);
    }
    scrape.into_text()
}

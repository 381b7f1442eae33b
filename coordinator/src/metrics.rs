//! The coordinator's metrics, and their values at a scrape. A test writes
//! the list in `docs/metrics.md`.

use swarm_telemetry::{Histogram, Metric, Scrape, metrics};
use tokio::sync::oneshot;

use engine::JobStats;

use crate::{
    driver::{DriverEvent, EventSender, StatsSnapshot},
    referee::Referee,
    runs::RunStats,
    server::calls::Calls,
    shared_store::SharedStore,
};

metrics! {
    BUILD = Gauge "swarm_coordinator_build_info" ["version", "fingerprint"]
        "1; the labels say which release runs, and with which simulation.";
    WORKERS = Gauge "swarm_workers" ["state"]
        "Connected workers: available for work, draining (they finish their items and leave), waiting (they get no items for a while, because they returned nothing or their result is in doubt), or distrusted (in quarantine, because they returned a wrong result).";
    SLOTS = Gauge "swarm_slots" []
        "Items that all connected workers together compute at the same time.";
    SLOT_TIME = Counter "swarm_slot_seconds_total" []
        "Time that slots have existed, summed over slots.";
    BUSY_TIME = Counter "swarm_slot_busy_seconds_total" []
        "Part of swarm_slot_seconds_total that led to results.";
    WORKERS_JOINED = Counter "swarm_workers_joined_total" []
        "Workers that have connected; a worker that reconnects counts again.";
    WORKERS_LEFT = Counter "swarm_workers_left_total" []
        "Workers that announced their end and left.";
    WORKERS_LOST = Counter "swarm_workers_lost_total" []
        "Workers whose connection broke, that fell silent, or that the coordinator dropped.";
    ITEMS_ASSIGNED = Counter "swarm_items_assigned_total" []
        "Items assigned to workers, including duplicates.";
    ITEMS_COMPUTED = Counter "swarm_items_computed_total" []
        "Items for which a worker returned fitness.";
    ITEMS_FAILED = Counter "swarm_items_failed_total" []
        "Items that a worker could not compute.";
    ITEMS_REQUEUED = Counter "swarm_items_requeued_total" []
        "Assignments that ended without a result because their worker left, was lost, stalled, went \
         into quarantine, or failed while in doubt; also audits.";
    ITEMS_RECALLED = Counter "swarm_items_recalled_total" []
        "Items taken back from a worker because another one has the result, or computes it sooner.";
    EPISODES = Counter "swarm_episodes_total" []
        "Episodes with a known fitness; an episode counts twice only if its first worker was faulty.";
    WORKERS_QUARANTINED = Counter "swarm_workers_quarantined_total" []
        "Workers that were proved faulty.";
    WORKERS_STALLED = Counter "swarm_workers_stalled_total" []
        "Times that a worker returned nothing for long while others returned results or were idle.";
    REFEREE_QUESTIONS = Counter "swarm_referee_questions_total" []
        "Items sent to the referee because a worker's result was in doubt.";
    REFEREE_VERDICTS = Counter "swarm_referee_verdicts_total" ["verdict"]
        "Answers of the referee: values, failed, died (its process, over the item) or unavailable.";
    REFEREE_BUSY_TIME = Counter "swarm_referee_busy_seconds_total" []
        "Time that the referee has spent on items.";
    COMMIT_DURATION = Histogram "swarm_commit_duration_seconds" []
        "Time to serialise a completed generation and write it to disk.";
    STORE_AVAILABLE = Gauge "swarm_store_available" []
        "1, or 0 if the latest write did not reach the disk.";
    CALLS = Counter "swarm_grpc_calls_total" ["method", "code"]
        "Ended gRPC calls; a worker's stream is one call, and CANCELLED if the worker is gone.";
    STATE = Gauge "swarm_experiment_state" ["experiment", "name", "state"]
        "1 for the state, running or paused, of an unfinished experiment.";
    GENERATIONS_WANTED = Gauge "swarm_experiment_generations_wanted" ["experiment", "name"]
        "Generations that the experiment will have.";
    GENERATIONS_COMPLETED = Gauge "swarm_experiment_generations_completed" ["experiment", "name"]
        "Generations that are on disk.";
    BEST_FITNESS = Gauge "swarm_experiment_best_fitness" ["experiment", "name"]
        "Best fitness of the latest completed generation.";
    MEAN_FITNESS = Gauge "swarm_experiment_mean_fitness" ["experiment", "name"]
        "Mean fitness of the latest completed generation.";
    GENERATION_DURATION = Gauge "swarm_experiment_generation_duration_seconds" ["experiment", "name"]
        "Time from the first to the last item of the latest completed generation.";
    IDLE = Gauge "swarm_experiment_barrier_idle_ratio" ["experiment", "name"]
        "Share of the slots' time, 0 to 1, that led to no results during the latest completed generation.";
    EXPERIMENT_EPISODES = Counter "swarm_experiment_episodes_total" ["experiment", "name"]
        "Episodes of the experiment with a known fitness.";
    ITEMS_QUEUED = Gauge "swarm_experiment_items_queued" ["experiment", "name"]
        "Items that wait for a worker; 0 while the experiment is paused.";
    ITEMS_IN_FLIGHT = Gauge "swarm_experiment_items_in_flight" ["experiment", "name"]
        "Items that workers hold and have not answered, duplicates included.";
}

/// Upper bounds of the buckets for commits, s: a fast disk takes less than 1 ms, a busy one tenths
/// of a second. On a full disk, a commit takes until there is space.
const COMMIT_BOUNDS_S: [f64; 13] =
    [0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0];

/// Values that are measured as they happen; all others are read at a scrape.
#[derive(Debug, Clone)]
pub struct Instruments {
    /// Durations of commits, s.
    pub commit_duration: Histogram,
    /// Calls of all services.
    pub calls: Calls,
}

impl Default for Instruments {
    fn default() -> Self {
        Self {
            commit_duration: COMMIT_DURATION.histogram(&COMMIT_BOUNDS_S),
            calls: Calls::default(),
        }
    }
}

/// The sources of the values.
#[derive(Debug, Clone)]
pub struct Source {
    /// The channel to the driver.
    pub events: EventSender,
    /// The store, which knows whether its latest write succeeded.
    pub store: SharedStore,
    /// The referee, which counts its answers.
    pub referee: Referee,
    /// The values measured as they happen.
    pub instruments: Instruments,
}

impl Source {
    /// All values in Prometheus' text format; none while the coordinator stops.
    pub async fn scrape(self) -> Option<String> {
        let (reply, stats) = oneshot::channel();
        self.events.send(DriverEvent::StatsRequested(reply)).await.ok()?;
        let StatsSnapshot { fleet, runs } = stats.await.ok()?;
        let mut scrape = Scrape::default();
        let version = env!("CARGO_PKG_VERSION");
        scrape.put(&BUILD, &[version, sim_core::FINGERPRINT], 1.0);
        let counters = fleet.counters;
        let referee = self.referee.stats();
        for (verdict, n_verdicts) in [
            ("values", referee.n_values),
            ("failed", referee.n_failed),
            ("died", referee.n_died),
            ("unavailable", referee.n_unavailable),
        ] {
            scrape.put(&REFEREE_VERDICTS, &[verdict], n_verdicts as f64);
        }
        for (state, n_workers) in [
            ("available", fleet.n_workers_available),
            ("draining", fleet.n_workers_draining),
            ("waiting", fleet.n_workers_waiting),
            ("distrusted", fleet.n_workers_quarantined),
        ] {
            scrape.put(&WORKERS, &[state], n_workers as f64);
        }
        for (metric, value) in [
            (&SLOTS, fleet.n_slots as f64),
            (&SLOT_TIME, fleet.slot_time_s),
            (&BUSY_TIME, fleet.busy_time_s),
            (&WORKERS_JOINED, counters.n_workers_joined as f64),
            (&WORKERS_LEFT, counters.n_workers_left as f64),
            (&WORKERS_LOST, counters.n_workers_lost as f64),
            (&ITEMS_ASSIGNED, counters.n_items_assigned as f64),
            (&ITEMS_COMPUTED, counters.n_items_computed as f64),
            (&ITEMS_FAILED, counters.n_items_failed as f64),
            (&ITEMS_REQUEUED, counters.n_items_requeued as f64),
            (&ITEMS_RECALLED, counters.n_items_recalled as f64),
            (&EPISODES, counters.n_episodes as f64),
            (&WORKERS_QUARANTINED, counters.n_workers_quarantined as f64),
            (&WORKERS_STALLED, counters.n_workers_stalled as f64),
            (&REFEREE_QUESTIONS, counters.n_questions as f64),
            (&REFEREE_BUSY_TIME, referee.busy.as_secs_f64()),
            (&STORE_AVAILABLE, if self.store.trouble().is_none() { 1.0 } else { 0.0 }),
        ] {
            scrape.put(metric, &[], value);
        }
        scrape.put_histogram(&COMMIT_DURATION, &self.instruments.commit_duration);
        for ((method, code), n_calls) in self.instruments.calls.ended() {
            scrape.put(&CALLS, &[&method, code], n_calls as f64);
        }
        runs.iter().for_each(|(run, work)| put_run(&mut scrape, run, work));
        Some(scrape.into_text())
    }
}

fn put_run(scrape: &mut Scrape, run: &RunStats, work: &JobStats) {
    let RunStats { experiment, name, generations_wanted, latest } = run;
    let labels = [&experiment.to_string(), name.as_str()];
    let state = if work.is_paused { "paused" } else { "running" };
    scrape.put(&STATE, &[labels[0], labels[1], state], 1.0);
    let mut put = |metric: &Metric, value: f64| scrape.put(metric, &labels, value);
    put(&GENERATIONS_WANTED, *generations_wanted as f64);
    put(&GENERATIONS_COMPLETED, latest.as_ref().map_or(0, |latest| latest.generation + 1) as f64);
    put(&EXPERIMENT_EPISODES, work.n_episodes as f64);
    put(&ITEMS_QUEUED, work.n_items_queued as f64);
    put(&ITEMS_IN_FLIGHT, work.n_items_in_flight as f64);
    if let Some(latest) = latest {
        put(&BEST_FITNESS, latest.statistics.best.get());
        put(&MEAN_FITNESS, latest.statistics.mean.get());
        put(&GENERATION_DURATION, latest.duration_ms as f64 / 1000.0);
        put(&IDLE, latest.idle_share);
    }
}

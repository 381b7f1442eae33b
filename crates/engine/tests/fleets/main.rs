//! The engine with fleets in virtual time: whatever happens to the workers, nothing is lost,
//! counts twice or grows without bound.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod auditors;
mod by_hand;
mod divided;
mod evaluations;
mod numbers;
mod proof;
mod timeline;
mod trouble;

use std::time::Duration;

use engine::EngineConfig;
use model::ids::{ExperimentId, JobId};
use numbers::{Ask as _, SimulatedFleet, fitness, population, simulated};
use proptest::prelude::*;
use simulated_fleet::{Conduct, FleetModel, uniform};

const LEASE: Duration = Duration::from_secs(10);
const EXPERIMENT: JobId = JobId::Experiment(ExperimentId(1));
const SECOND: Duration = Duration::from_secs(1);
const HOUR: Duration = Duration::from_secs(3600);

const MODEL: FleetModel = FleetModel {
    latency: Duration::from_millis(5),
    trial: Duration::from_millis(100),
    dispersion: 0.3,
    stops: false,
    checks: true,
};

fn fleet() -> SimulatedFleet {
    simulated(MODEL, EngineConfig::new(LEASE))
}

fn auditing_fleet(audit_fraction: f64) -> SimulatedFleet {
    simulated(MODEL, EngineConfig { audit_fraction, ..EngineConfig::new(LEASE) })
}

fn is_finished(fleet: &SimulatedFleet) -> bool {
    !fleet.evaluated.is_empty()
}

#[track_caller]
fn assert_right(fleet: &SimulatedFleet, n_individuals: usize, n_trials: u32) {
    let (_, evaluated) = fleet.evaluated.last().expect("an evaluated batch");
    let expected: Vec<Vec<f64>> = population(n_individuals)
        .iter()
        .map(|genotype| (0..n_trials).map(|trial| fitness(genotype, trial)).collect())
        .collect();
    assert_eq!(evaluated.values, expected);
}

/// The time of one generation.
fn generation_time(config: EngineConfig, speeds: &[f64], n_individuals: usize) -> Duration {
    let mut fleet = simulated(FleetModel { checks: false, ..MODEL }, config);
    for &speed in speeds {
        fleet.join(1, speed);
    }
    fleet.submit(EXPERIMENT, 100);
    for generation in 0..3 {
        fleet.ask(EXPERIMENT, generation, n_individuals, 5);
        assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() as u64 > generation));
        assert_right(&fleet, n_individuals, 5);
    }
    fleet.evaluated[2].1.duration
}

#[test]
fn a_fast_worker_is_given_more_items_ahead_than_a_slow_one() {
    let model = FleetModel { trial: Duration::from_millis(3), dispersion: 0.0, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    fleet.join(1, 0.5);
    fleet.join(1, 1.5);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 100, 1);
    assert!(fleet.run_until(HOUR, is_finished));
    fleet.run_for(SECOND);
    fleet.ask(EXPERIMENT, 1, 8, 1);
    let in_flight: Vec<usize> = fleet.status().iter().map(|worker| worker.n_in_flight).collect();
    assert_eq!(in_flight, [2, 6]);
}

#[test]
fn a_thousand_workers_come_and_go_and_ten_thousand_individuals_are_evaluated() {
    let model = FleetModel { checks: false, trial: SECOND, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    for worker in 0..1000 {
        fleet.join(1, 0.25 + uniform(worker));
    }
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 10_000, 1);
    let mut n_replaced = 0;
    while fleet.evaluated.is_empty() {
        fleet.run_for(SECOND);
        fleet.engine.sanity_check();
        let ids = fleet.worker_ids();
        for (i, &id) in ids.iter().enumerate() {
            match (uniform(fleet.now().as_millis() as u64 ^ (i as u64) << 40) * 1000.0) as u32 {
                0 => {
                    fleet.kill(id);
                    n_replaced += 1;
                    fleet.join(1, 0.25 + uniform(1_000_000 + n_replaced));
                }
                1 => {
                    fleet.flap(id);
                }
                2 => fleet.stall(id, 20 * SECOND),
                3 => fleet.silence(id),
                _ => {}
            }
        }
        assert!(fleet.now() < HOUR);
    }
    assert!(fleet.failed.is_empty(), "{:?}", fleet.failed);
    assert!(n_replaced > 10);
    assert_right(&fleet, 10_000, 1);
}

#[test]
fn the_tail_of_a_generation_does_not_wait_for_the_slowest_worker() {
    let speeds: Vec<f64> = (0..10).map(|i| if i == 0 { 0.1 } else { 1.0 }).collect();
    let plain = EngineConfig { split: false, duplicate: false, ..EngineConfig::new(LEASE) };
    let whole = generation_time(plain, &speeds, 20);
    let shared = generation_time(EngineConfig::new(LEASE), &speeds, 20);
    assert!(shared < whole / 2, "{shared:?} instead of {whole:?}");
}

#[test]
fn few_individuals_on_many_workers_are_split_by_trial() {
    let plain = EngineConfig { split: false, duplicate: false, ..EngineConfig::new(LEASE) };
    let whole = generation_time(plain, &[1.0; 100], 10);
    let split = generation_time(EngineConfig::new(LEASE), &[1.0; 100], 10);
    assert!(split < whole / 2, "{split:?} instead of {whole:?}");
}

#[test]
fn a_stalled_worker_holds_nobody_up() {
    let mut fleet = fleet();
    let ids: Vec<_> = (0..10).map(|_| fleet.join(1, 1.0)).collect();
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 100, 5);
    fleet.run_for(2 * SECOND);
    fleet.stall(ids[3], HOUR);
    assert!(fleet.run_until(60 * SECOND, is_finished));
    assert_right(&fleet, 100, 5);
    assert!(fleet.now() < 12 * SECOND, "{:?}", fleet.now());
}

#[test]
fn short_items_keep_slots_busy_over_a_slow_network() {
    let (trial, latency) = (Duration::from_millis(1), Duration::from_millis(4));
    let model = FleetModel { trial, latency, checks: false, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    fleet.join(4, 1.0);
    fleet.submit(EXPERIMENT, 100);
    for generation in 0..2 {
        fleet.ask(EXPERIMENT, generation, 4000, 1);
        assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() as u64 > generation));
    }
    let idle = fleet.evaluated[1].1.idle_share;
    assert!(idle < 0.05, "{idle}");
    let status = &fleet.status()[0];
    assert!(status.idle_share < 0.2 && status.results_per_s > 1000.0, "{status:?}");
}

#[test]
fn fast_workers_get_more_of_short_trials_and_all_end_together() {
    let (trial, latency) = (Duration::from_millis(1), Duration::from_micros(100));
    let model = FleetModel { trial, latency, ..MODEL };
    let idle_share = |config| {
        let mut fleet = simulated(model, config);
        // One worker is three times as fast as the other.
        for worker in 0..40 {
            fleet.join(1, 0.5 + f64::from(worker) / 40.0);
        }
        fleet.submit(EXPERIMENT, 100);
        for generation in 0..8 {
            fleet.ask(EXPERIMENT, generation, 40, 5);
            assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() as u64 > generation));
            assert_right(&fleet, 40, 5);
        }
        let later = &fleet.evaluated[4..];
        later.iter().map(|(_, evaluated)| evaluated.idle_share).sum::<f64>() / later.len() as f64
    };
    let whole = idle_share(EngineConfig { split: false, ..EngineConfig::new(LEASE) });
    let shared = idle_share(EngineConfig::new(LEASE));
    assert!(whole > 0.4 && shared < 0.25, "{whole} {shared}");
}

#[test]
fn experiments_share_the_fleet_by_priority() {
    let (low, high) = (JobId::Experiment(ExperimentId(1)), JobId::Experiment(ExperimentId(2)));
    let mut fleet = simulated(FleetModel { checks: false, ..MODEL }, EngineConfig::new(LEASE));
    for _ in 0..10 {
        fleet.join(1, 1.0);
    }
    for (id, weight) in [(low, 100), (high, 300)] {
        fleet.submit(id, weight);
        // The items have different lengths, because jobs share time, not items.
        if id == low { fleet.ask(id, 0, 6000, 1) } else { fleet.ask(id, 0, 3000, 4) }
    }
    assert!(fleet.run_until(HOUR, is_finished));
    assert_eq!(fleet.evaluated[0].0, high);
    // 3000 items of 0.44 s with three quarters of ten workers.
    let expected = 3000.0 * 0.44 / 7.5;
    let taken = fleet.now().as_secs_f64();
    assert!((taken / expected - 1.0).abs() < 0.1, "{taken} s, not {expected} s");
}

#[test]
fn workers_serve_another_experiment_while_one_is_at_its_barrier() {
    let (a, b) = (JobId::Experiment(ExperimentId(1)), JobId::Experiment(ExperimentId(2)));
    let mut fleet = fleet();
    fleet.join(1, 1.0);
    fleet.submit(a, 1000);
    fleet.submit(b, 1);
    fleet.ask(a, 0, 2, 1);
    fleet.ask(b, 0, 10, 1);
    assert!(fleet.run_until(HOUR, is_finished));
    assert_eq!(fleet.evaluated[0].0, a);
    let before = fleet.n_items_sent;
    fleet.run_for(SECOND);
    assert!(fleet.n_items_sent > before);
    // A job saves up no turns while it has no items.
    fleet.ask(a, 1, 2, 1);
    assert!(fleet.run_until(SECOND, |fleet| fleet.evaluated.len() == 2));
    assert_eq!(fleet.evaluated[1].0, a);
}

#[test]
fn a_paused_experiment_gives_its_workers_up_and_goes_on_where_it_was() {
    let mut fleet = fleet();
    for _ in 0..4 {
        fleet.join(2, 1.0);
    }
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 40, 5);
    fleet.run_for(SECOND);
    let n_sent = fleet.n_items_sent;
    fleet.tell(|engine, now| engine.on_job_paused(now, EXPERIMENT));
    assert!(fleet.status().iter().all(|worker| worker.n_in_flight == 0));
    fleet.run_for(HOUR);
    assert_eq!(fleet.n_items_sent, n_sent);
    fleet.tell(|engine, now| engine.on_job_resumed(now, EXPERIMENT));
    assert!(fleet.run_until(HOUR, is_finished));
    assert_right(&fleet, 40, 5);
}

#[test]
fn audits_find_a_faulty_worker_and_the_generation_goes_on_without_it() {
    let mut fleet = auditing_fleet(0.2);
    let ids: Vec<_> = (0..5).map(|_| fleet.join(1, 1.0)).collect();
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 50, 2);
    assert!(fleet.run_until(HOUR, is_finished));
    let evaluated = &fleet.evaluated[0].1;
    assert!(evaluated.n_audited >= 5 && evaluated.n_unaudited == 0, "{evaluated:?}");
    assert_right(&fleet, 50, 2);

    fleet.set_conduct(ids[2], Conduct::Lies);
    fleet.ask(EXPERIMENT, 1, 50, 2);
    assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() == 2));
    assert_right(&fleet, 50, 2);
    let names: Vec<&str> = fleet.quarantined.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["worker-3"]);
    let quarantined = fleet.status().into_iter().filter(|worker| worker.quarantined.is_some());
    assert_eq!(quarantined.map(|worker| worker.id).collect::<Vec<_>>(), [ids[2]]);
}

#[test]
fn audits_are_waived_when_there_is_no_second_worker() {
    let mut fleet = auditing_fleet(1.0);
    fleet.join(1, 1.0);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 5, 1);
    assert!(fleet.run_until(HOUR, is_finished));
    assert_eq!(fleet.evaluated[0].1.n_unaudited, 5);
    assert!(fleet.now() >= 30 * SECOND, "the audits wait for a second worker");
    // A second worker, which leaves in the middle of the batch.
    let second = fleet.join(1, 0.1);
    fleet.ask(EXPERIMENT, 1, 5, 1);
    fleet.run_for(2 * SECOND);
    assert_eq!(fleet.evaluated.len(), 1, "the batch waits for the second worker");
    fleet.kill(second);
    assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() == 2));
    assert_right(&fleet, 5, 1);
}

#[test]
fn flapping_streams_are_not_blamed_on_the_work() {
    let mut fleet = fleet();
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 3, 1);
    fleet.join(1, 0.02);
    for _ in 0..20 {
        fleet.run_for(SECOND);
        let id = fleet.worker_ids()[0];
        fleet.flap(id);
    }
    assert!(fleet.run_until(HOUR, is_finished));
    assert!(fleet.failed.is_empty(), "{:?}", fleet.failed);
    assert_right(&fleet, 3, 1);
}

#[test]
fn the_engine_is_a_function_of_its_events() {
    let history = || {
        let mut fleet = fleet();
        for worker in 0..20 {
            fleet.join(1 + worker % 3, 0.5 + uniform(worker as u64));
        }
        fleet.submit(EXPERIMENT, 100);
        fleet.ask(EXPERIMENT, 0, 100, 5);
        assert!(fleet.run_until(HOUR, is_finished));
        (fleet.now(), fleet.n_items_sent, fleet.n_items_dropped)
    };
    assert_eq!(history(), history());
}

#[derive(Debug, Clone)]
enum Happening {
    Join(usize, f64),
    Kill(usize),
    Flap(usize),
    Stall(usize),
    Silence(usize),
    Drain(usize),
    PauseAndResume,
    Wait,
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        3 => (1..4usize, 0.1..2.0).prop_map(|(n, speed)| Happening::Join(n, speed)),
        1 => any::<usize>().prop_map(Happening::Kill),
        2 => any::<usize>().prop_map(Happening::Flap),
        2 => any::<usize>().prop_map(Happening::Stall),
        1 => any::<usize>().prop_map(Happening::Silence),
        1 => any::<usize>().prop_map(Happening::Drain),
        1 => Just(Happening::PauseAndResume),
        12 => Just(Happening::Wait),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// No item is lost or accepted twice, the engine's state never contradicts itself (it is
    /// checked after every event), and each worker's number of items is bounded.
    #[test]
    fn any_history_evaluates_the_same_fitness(
        history in prop::collection::vec(happening(), 0..60),
        n_individuals in 1..40usize,
        n_trials in 1..6u32,
        audit_fraction in prop_oneof![Just(0.0), Just(0.3), Just(1.0)],
        stops in any::<bool>(),
    ) {
        let config = EngineConfig { audit_fraction, ..EngineConfig::new(LEASE) };
        let mut fleet = simulated(FleetModel { stops, ..MODEL }, config);
        fleet.submit(EXPERIMENT, 100);
        fleet.ask(EXPERIMENT, 0, n_individuals, n_trials);
        for happening in history {
            let ids = fleet.worker_ids();
            let pick = |i: usize| (!ids.is_empty()).then(|| ids[i % ids.len()]);
            match happening {
                Happening::Join(n_slots, speed) => { fleet.join(n_slots, speed); }
                Happening::Kill(i) => if let Some(id) = pick(i) { fleet.kill(id) },
                Happening::Flap(i) => if let Some(id) = pick(i) { fleet.flap(id); },
                Happening::Stall(i) => if let Some(id) = pick(i) { fleet.stall(id, 5 * SECOND) },
                Happening::Silence(i) => if let Some(id) = pick(i) { fleet.silence(id) },
                Happening::Drain(i) => if let Some(id) = pick(i) { fleet.drain(id) },
                Happening::PauseAndResume => {
                    fleet.tell(|engine, now| engine.on_job_paused(now, EXPERIMENT));
                    fleet.tell(|engine, now| engine.on_job_resumed(now, EXPERIMENT));
                }
                Happening::Wait => fleet.run_for(SECOND / 3),
            }
            for worker in fleet.status() {
                prop_assert!(worker.n_in_flight <= model::limits::ITEMS_PER_SLOT_MAX * worker.n_slots);
            }
        }
        fleet.join(2, 1.0);
        prop_assert!(fleet.run_until(HOUR, is_finished));
        assert_right(&fleet, n_individuals, n_trials);
        prop_assert_eq!(fleet.evaluated.len(), 1);
        prop_assert!(fleet.failed.is_empty() && fleet.quarantined.is_empty());
    }
}

/// Two copies of an item are lost within a second, so the item waits twice. The property above
/// found this case.
#[test]
fn an_item_of_which_two_copies_are_lost_is_queued_once() {
    let config = EngineConfig { audit_fraction: 0.3, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(FleetModel { stops: false, ..MODEL }, config);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 8, 5);
    let stalled = fleet.join(3, 0.1);
    fleet.run_for(SECOND / 3);
    fleet.stall(stalled, 5 * SECOND);
    let second = fleet.join(2, 1.980_273_145_185_609_5);
    fleet.run_for(SECOND / 3);
    let third = fleet.join(3, 0.1);
    fleet.run_for(SECOND / 3);
    fleet.kill(third);
    fleet.join(1, 0.1);
    fleet.kill(second);
    fleet.run_for(SECOND / 3);
    let returned = fleet.flap(stalled).expect("it is connected");
    fleet.join(2, 1.622_897_392_274_333);
    fleet.join(3, 0.107_233_302_589_703_01);
    fleet.run_for(SECOND / 3);
    fleet.kill(returned);
    fleet.join(2, 1.0);
    assert!(fleet.run_until(HOUR, is_finished));
    assert_right(&fleet, 8, 5);
}

//! The engine's rules one by one, with workers that compute on the test's command.

use std::time::Duration;

use engine::EngineConfig;
use model::ids::{AssignmentId, ExperimentId, JobId, WorkerId};

use super::numbers::{Ask as _, SimulatedFleet, fitness, simulated};
use super::{EXPERIMENT, LEASE, MODEL, SECOND, assert_right, auditing_fleet, fleet};
use simulated_fleet::FleetModel;

/// A fleet whose engine neither splits nor duplicates items, so that a test can count them.
pub(super) fn plain_fleet() -> SimulatedFleet {
    let config = EngineConfig { split: false, duplicate: false, ..EngineConfig::new(LEASE) };
    simulated(MODEL, config)
}

pub(super) fn start(fleet: &mut SimulatedFleet, id: JobId, n_individuals: usize, n_trials: u32) {
    fleet.submit(id, 100);
    fleet.ask(id, 0, n_individuals, n_trials);
}

#[track_caller]
pub(super) fn assert_evaluated(fleet: &SimulatedFleet, n_individuals: usize, n_trials: u32) {
    assert_right(fleet, n_individuals, n_trials);
    assert_eq!(fleet.evaluated.len(), 1, "a batch is evaluated once");
}

#[test]
fn fitness_is_in_index_order_whoever_computed_it() {
    let mut fleet = plain_fleet();
    fleet.join_by_hand(1);
    fleet.join_by_hand(3);
    start(&mut fleet, EXPERIMENT, 50, 4);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 50, 4);
    assert_eq!(fleet.n_items_sent, 50);
}

#[test]
fn a_worker_is_sent_a_distribution_once_per_generation_and_draws_from_it() {
    let mut fleet = plain_fleet();
    fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 20, 1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 20, 1);
    assert_eq!((fleet.n_distributions_sent, fleet.n_items_drawn), (1, 20));
    fleet.ask(EXPERIMENT, 1, 20, 1);
    fleet.run_by_hand();
    assert_eq!((fleet.n_distributions_sent, fleet.n_items_drawn), (2, 40));
}

#[test]
fn genotypes_are_sent_if_they_are_shorter_than_the_distribution() {
    let mut fleet = plain_fleet();
    for _ in 0..10 {
        fleet.join_by_hand(1);
    }
    start(&mut fleet, EXPERIMENT, 20, 1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 20, 1);
    assert_eq!((fleet.n_distributions_sent, fleet.n_items_drawn), (0, 0), "two are shorter");
}

#[test]
fn audits_get_genotypes_so_that_both_ways_are_compared() {
    let mut fleet = auditing_fleet(1.0);
    fleet.join_by_hand(1);
    fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 20, 1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 20, 1);
    assert_eq!((fleet.n_items_sent, fleet.n_items_drawn), (40, 20));
}

#[test]
fn work_waits_for_the_first_worker() {
    let mut fleet = fleet();
    start(&mut fleet, EXPERIMENT, 3, 1);
    fleet.join_by_hand(1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 3, 1);
}

#[test]
fn items_of_a_lost_worker_go_to_others() {
    let mut fleet = plain_fleet();
    let lost = fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 10, 2);
    fleet.run_for(SECOND);
    fleet.step(lost);
    assert_eq!(fleet.assigned(lost).len(), 3, "long items do not wait in line");
    fleet.kill(lost);
    fleet.join_by_hand(1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 10, 2);
    assert_eq!(fleet.n_items_sent, 10 + 3);
}

#[test]
fn a_silent_worker_is_dropped_after_its_lease_and_a_busy_one_is_not() {
    let mut fleet = plain_fleet();
    let silent = fleet.join_by_hand(1);
    let busy = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 6, 1);
    fleet.silence(silent);
    fleet.run_for(LEASE + SECOND);
    assert_eq!(fleet.worker_ids(), [busy]);
    assert_eq!(fleet.assigned(busy).len(), 2, "long episodes are no reason to lose work");
    fleet.run_by_hand();
    assert_evaluated(&fleet, 6, 1);
}

#[test]
fn a_pause_of_the_coordinator_is_not_its_workers_silence() {
    let mut fleet = fleet();
    let id = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 2, 1);
    fleet.freeze(LEASE * 100);
    assert_eq!(fleet.worker_ids(), [id]);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 2, 1);
}

#[test]
fn results_of_unknown_items_and_of_ended_experiments_are_ignored() {
    let mut fleet = fleet();
    let id = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 2, 1);
    let assignment = fleet.assigned(id)[0].id;
    fleet.answer(id, AssignmentId(999), Ok(vec![5.0]));
    fleet.tell(|engine, now| engine.on_job_ended(now, EXPERIMENT));
    fleet.answer(id, assignment, Ok(vec![5.0]));
    assert!(fleet.evaluated.is_empty());
}

#[test]
fn a_job_that_starts_again_begins_anew_and_leaves_nothing_behind_at_its_end() {
    let mut fleet = plain_fleet();
    let worker = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 10, 1);
    assert!(!fleet.assigned(worker).is_empty());
    fleet.submit(EXPERIMENT, 100);
    assert!(fleet.assigned(worker).is_empty(), "the former items are taken back");
    fleet.ask(EXPERIMENT, 0, 10, 1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 10, 1);

    fleet.ask(EXPERIMENT, 1, 10, 1);
    fleet.submit(EXPERIMENT, 100);
    fleet.tell(|engine, now| engine.on_job_ended(now, EXPERIMENT));
    let other = fleet.join_by_hand(1);
    assert!([worker, other].into_iter().all(|id| fleet.assigned(id).is_empty()));
}

#[test]
fn a_result_that_comes_twice_counts_once() {
    let mut fleet = fleet();
    let id = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 2, 1);
    let assignment = fleet.assigned(id)[0].clone();
    fleet.answer(id, assignment.id, Ok(vec![fitness(&assignment.genotype, 0)]));
    fleet.answer(id, assignment.id, Ok(vec![-1.0]));
    fleet.run_by_hand();
    assert_evaluated(&fleet, 2, 1);
}

#[test]
fn experiments_take_turns() {
    let mut fleet = fleet();
    let other = JobId::Experiment(ExperimentId(2));
    start(&mut fleet, EXPERIMENT, 100, 1);
    start(&mut fleet, other, 4, 1);
    let id = fleet.join_by_hand(1);
    while fleet.evaluated.is_empty() {
        assert!(fleet.step(id));
    }
    assert_eq!(fleet.evaluated[0].0, other, "the short one need not wait for the long one");
}

#[test]
fn activity_names_the_items_of_each_worker_with_their_age() {
    let mut fleet = plain_fleet();
    let other = JobId::Experiment(ExperimentId(2));
    start(&mut fleet, EXPERIMENT, 5, 2);
    let waiting = fleet.activity(EXPERIMENT);
    assert_eq!((waiting.n_workers, waiting.rivals), (0, vec![]));
    let batch = waiting.batch.unwrap();
    assert_eq!((batch.n_items_queued, batch.n_episodes, batch.n_episodes_left), (5, 10, 10));

    let worker = fleet.join_by_hand(1);
    fleet.run_for(SECOND);
    fleet.step(worker);
    fleet.drain(worker);
    fleet.run_for(3 * SECOND);
    start(&mut fleet, other, 3, 1);
    let activity = fleet.activity(EXPERIMENT);
    assert_eq!((activity.n_workers, activity.n_workers_available), (1, 0));
    assert_eq!(activity.rivals, [other]);
    let batch = activity.batch.unwrap();
    assert_eq!(batch.running_for, 4 * SECOND);
    let [share] = &batch.shares[..] else { panic!("{batch:?}") };
    assert_eq!(batch.n_items_queued + share.n_items, 4);
    assert_eq!((share.worker, share.oldest_for), (worker, 4 * SECOND), "the oldest counts");
    assert_eq!(fleet.activity(JobId::Experiment(ExperimentId(9))).batch, None);
}

#[test]
fn idle_share_is_the_time_slots_did_not_compute() {
    let mut fleet = fleet();
    let id = fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 1, 1);
    fleet.run_for(Duration::from_millis(200));
    fleet.step(id);
    let (_, evaluated) = &fleet.evaluated[0];
    assert_eq!(evaluated.duration, Duration::from_millis(200));
    assert!((evaluated.idle_share - 0.75).abs() < 1e-9, "{}", evaluated.idle_share);
}

#[test]
fn ten_thousand_workers_share_a_generation() {
    let model = FleetModel { checks: false, ..MODEL };
    let mut fleet = simulated(model, EngineConfig::new(LEASE));
    let ids: Vec<WorkerId> = (0..10_000).map(|_| fleet.join_by_hand(1)).collect();
    start(&mut fleet, EXPERIMENT, 10_000, 1);
    fleet.engine.sanity_check();
    assert!(ids.into_iter().all(|id| fleet.assigned(id).len() == 1));
}

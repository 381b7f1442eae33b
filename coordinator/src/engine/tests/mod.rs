//! The engine, driven through histories of a fleet.

mod evaluations;
mod fleet;
mod histories;

use std::time::Duration;

use super::*;
use crate::ids::{AssignmentId, ExperimentId};

use fleet::{FakeWorker, Fleet, fitness, introduction};

const LEASE: Duration = Duration::from_secs(10);
const EXPERIMENT: JobId = JobId::Experiment(ExperimentId(1));

#[test]
fn fitness_is_in_index_order_whoever_computed_it() {
    let mut fleet = Fleet::plain();
    fleet.join(1);
    fleet.join(3);
    fleet.start(EXPERIMENT, 50, 4);
    fleet.run();
    fleet.assert_evaluated(50, 4);
    assert_eq!(fleet.n_items_sent, 50);
}

#[test]
fn work_waits_for_the_first_worker() {
    let mut fleet = Fleet::new();
    fleet.start(EXPERIMENT, 3, 1);
    fleet.join(1);
    fleet.run();
    fleet.assert_evaluated(3, 1);
}

#[test]
fn items_of_a_lost_worker_go_to_others() {
    let mut fleet = Fleet::plain();
    let lost = fleet.join(2);
    fleet.start(EXPERIMENT, 10, 2);
    fleet.compute_time = Duration::from_secs(1);
    fleet.now += fleet.compute_time;
    fleet.step(lost);
    assert_eq!(fleet.workers[&lost].assignments.len(), 3, "long items do not wait in line");
    fleet.kill(lost);
    fleet.join(1);
    fleet.run();
    fleet.assert_evaluated(10, 2);
    assert_eq!(fleet.n_items_sent, 10 + 3);
}

#[test]
fn a_silent_worker_is_dropped_after_its_lease_and_a_busy_one_is_not() {
    let mut fleet = Fleet::plain();
    let silent = fleet.join(1);
    let busy = fleet.join(1);
    fleet.start(EXPERIMENT, 6, 1);
    for _ in 0..4 {
        fleet.now += LEASE / 3;
        fleet.engine.on_heartbeat(fleet.now, busy);
        fleet.engine.on_tick(fleet.now);
        fleet.carry_out();
    }
    assert!(!fleet.workers.contains_key(&silent));
    assert_eq!(
        fleet.workers[&busy].assignments.len(),
        2,
        "long episodes are no reason to lose work"
    );
    fleet.run();
    fleet.assert_evaluated(6, 1);
}

#[test]
fn a_pause_of_the_coordinator_is_not_its_workers_silence() {
    let mut fleet = Fleet::new();
    let id = fleet.join(1);
    fleet.start(EXPERIMENT, 2, 1);
    fleet.now += LEASE * 100;
    fleet.engine.on_tick(fleet.now);
    fleet.carry_out();
    assert!(fleet.workers.contains_key(&id));
    fleet.run();
    fleet.assert_evaluated(2, 1);
}

#[test]
fn silence_is_not_blamed_on_items() {
    let mut fleet = Fleet::new();
    fleet.start(EXPERIMENT, 1, 1);
    for _ in 0..2 * MAX_ATTEMPTS {
        fleet.join(1);
        for _ in 0..4 {
            fleet.now += LEASE / 4;
            fleet.engine.on_tick(fleet.now);
            fleet.carry_out();
        }
        assert!(fleet.workers.is_empty());
    }
    fleet.join(1);
    fleet.run();
    fleet.assert_evaluated(1, 1);
}

#[test]
fn a_draining_worker_gets_nothing_more_and_is_not_blamed() {
    let mut fleet = Fleet::plain();
    fleet.start(EXPERIMENT, 1, 1);
    for _ in 0..2 * MAX_ATTEMPTS {
        let id = fleet.join(1);
        fleet.engine.on_draining(fleet.now, id);
        fleet.kill(id);
    }
    let id = fleet.join(1);
    fleet.engine.on_draining(fleet.now, id);
    fleet.step(id);
    fleet.assert_evaluated(1, 1);
    fleet.ask(EXPERIMENT, 1, 1, 1);
    assert!(fleet.workers[&id].assignments.is_empty());
}

#[test]
fn an_item_that_takes_its_workers_down_fails_its_experiment_and_no_other() {
    let mut fleet = Fleet::new();
    let other = JobId::Experiment(ExperimentId(2));
    fleet.start(EXPERIMENT, 1, 1);
    for _ in 0..MAX_ATTEMPTS {
        assert!(fleet.failed.is_empty());
        let id = fleet.join(1);
        fleet.kill(id);
    }
    assert_eq!(fleet.failed.len(), 1);
    assert_eq!(fleet.failed[0].0, EXPERIMENT);
    assert!(fleet.failed[0].1.contains("individual 0 of generation 0"), "{}", fleet.failed[0].1);
    fleet.join(1);
    fleet.start(other, 5, 1);
    fleet.run();
    assert_eq!(fleet.evaluated[0].0, other);
}

#[test]
fn items_that_wait_in_a_lost_worker_are_not_blamed() {
    let mut fleet = Fleet::plain();
    fleet.start(EXPERIMENT, 2, 1);
    // One slot, two credits: individual 0 is computed, 1 waits. Answer 0 each
    // time under a fresh worker, and 1 is never the oldest.
    for _ in 0..MAX_ATTEMPTS - 1 {
        let id = fleet.join(1);
        assert_eq!(fleet.workers[&id].assignments.len(), 2);
        fleet.kill(id);
    }
    let id = fleet.join(1);
    fleet.step(id);
    fleet.kill(id);
    let id = fleet.join(1);
    fleet.step(id);
    assert!(fleet.failed.is_empty());
    fleet.assert_evaluated(2, 1);
}

#[test]
fn failing_items_are_tried_again_and_then_fail_the_experiment() {
    let mut fleet = Fleet::new();
    let id = fleet.join(1);
    fleet.start(EXPERIMENT, 1, 1);
    for _ in 0..MAX_ATTEMPTS {
        let assignment = fleet.workers.get_mut(&id).unwrap().assignments.pop_front().unwrap().1;
        fleet.answer(id, assignment.id, Err("it overflowed".to_owned()));
    }
    assert!(fleet.failed[0].1.contains("it overflowed"));
    assert!(fleet.workers.contains_key(&id), "the worker is not to blame");
}

#[test]
fn a_result_of_the_wrong_length_drops_its_worker() {
    let mut fleet = Fleet::new();
    let id = fleet.join(1);
    fleet.start(EXPERIMENT, 1, 2);
    let assignment = fleet.workers[&id].assignments[0].1.id;
    fleet.answer(id, assignment, Ok(vec![1.0]));
    assert!(fleet.workers.is_empty() && fleet.evaluated.is_empty());
}

#[test]
fn results_of_unknown_items_and_of_ended_experiments_are_ignored() {
    let mut fleet = Fleet::new();
    let id = fleet.join(1);
    fleet.start(EXPERIMENT, 2, 1);
    let assignment = fleet.workers[&id].assignments[0].1.id;
    fleet.answer(id, AssignmentId(999), Ok(vec![5.0]));
    fleet.engine.on_job_ended(fleet.now, EXPERIMENT);
    fleet.carry_out();
    fleet.answer(id, assignment, Ok(vec![5.0]));
    assert!(fleet.evaluated.is_empty());
    assert!(fleet.workers[&id].specs.is_empty());
}

#[test]
fn a_result_that_comes_twice_counts_once() {
    let mut fleet = Fleet::new();
    let id = fleet.join(1);
    fleet.start(EXPERIMENT, 2, 1);
    let assignment = fleet.workers[&id].assignments[0].1.clone();
    fleet.answer(id, assignment.id, Ok(vec![fitness(&assignment.genotype, 0)]));
    fleet.answer(id, assignment.id, Ok(vec![-1.0]));
    fleet.workers.get_mut(&id).unwrap().assignments.pop_front();
    fleet.run();
    fleet.assert_evaluated(2, 1);
}

/// Three workers with an item each; the first has finished its own, and has been
/// given the third's as well, which is late.
fn fleet_with_a_late_item() -> (Fleet, [WorkerId; 3], Assignment) {
    let mut fleet = Fleet::new();
    let workers = [fleet.join(1), fleet.join(1), fleet.join(1)];
    fleet.start(EXPERIMENT, 3, 1);
    let late = fleet.workers[&workers[2]].assignments[0].1.clone();
    fleet.compute_time = Duration::from_secs(1);
    fleet.now += fleet.compute_time;
    fleet.step(workers[0]);
    fleet.now += LEASE / 3;
    for id in workers {
        fleet.engine.on_heartbeat(fleet.now, id);
    }
    fleet.engine.on_tick(fleet.now);
    fleet.carry_out();
    let copy = &fleet.workers[&workers[0]].assignments[0].1;
    assert_eq!((&copy.genotype, &copy.trials), (&late.genotype, &late.trials));
    (fleet, workers, late)
}

#[test]
fn the_first_of_two_results_wins_and_the_other_worker_drops_the_item() {
    let (mut fleet, [first, _, third], late) = fleet_with_a_late_item();
    fleet.step(first);
    assert!(
        fleet.workers[&third].assignments.iter().all(|(_, assignment)| assignment.id != late.id)
    );
    // Its answer was under way already.
    fleet.answer(third, late.id, Ok(vec![fitness(&late.genotype, 0)]));
    assert!(fleet.paused.is_empty());
    fleet.run();
    fleet.assert_evaluated(3, 1);
}

#[test]
fn a_late_result_that_differs_pauses_the_experiment_and_its_generation_starts_over() {
    let (mut fleet, [first, second, third], late) = fleet_with_a_late_item();
    fleet.step(first);
    fleet.answer(third, late.id, Ok(vec![-1.0]));
    assert_eq!(fleet.paused.len(), 1);
    assert!(fleet.workers[&second].assignments.is_empty(), "paused");
    fleet.engine.on_job_resumed(fleet.now, EXPERIMENT);
    fleet.carry_out();
    assert!(
        fleet.workers[&first].assignments.is_empty()
            && fleet.workers[&third].assignments.is_empty()
    );
    fleet.run();
    fleet.assert_evaluated(3, 1);
}

#[test]
fn experiments_take_turns() {
    let mut fleet = Fleet::new();
    let other = JobId::Experiment(ExperimentId(2));
    fleet.start(EXPERIMENT, 100, 1);
    fleet.start(other, 4, 1);
    let id = fleet.join(1);
    while fleet.evaluated.is_empty() {
        assert!(fleet.step(id));
    }
    assert_eq!(fleet.evaluated[0].0, other, "the short one need not wait for the long one");
}

#[test]
fn activity_says_who_holds_what_since_when() {
    let mut fleet = Fleet::plain();
    let other = JobId::Experiment(ExperimentId(2));
    fleet.start(EXPERIMENT, 5, 2);
    let waiting = fleet.engine.activity(fleet.now, EXPERIMENT);
    assert_eq!((waiting.n_workers, waiting.rivals), (0, vec![]));
    let batch = waiting.batch.unwrap();
    assert_eq!((batch.n_items_queued, batch.n_episodes, batch.n_episodes_left), (5, 10, 10));

    let worker = fleet.join(1);
    fleet.now += Duration::from_secs(1);
    let failure = fleet.workers.get_mut(&worker).unwrap().assignments.pop_front().unwrap().1;
    fleet.answer(worker, failure.id, Err("too hot".to_owned()));
    fleet.engine.on_draining(fleet.now, worker);
    fleet.now += Duration::from_secs(3);
    fleet.start(other, 3, 1);
    let activity = fleet.engine.activity(fleet.now, EXPERIMENT);
    assert_eq!((activity.n_workers, activity.n_workers_available), (1, 0));
    assert_eq!(activity.rivals, [other]);
    let batch = activity.batch.unwrap();
    assert_eq!(batch.n_individuals_failing, 1);
    assert_eq!(batch.running_for, Duration::from_secs(4));
    let [held] = &batch.held[..] else { panic!("{batch:?}") };
    assert_eq!(batch.n_items_queued + held.n_items, 5);
    assert_eq!((held.worker, held.silent_for), (worker, Duration::from_secs(3)));
    assert_eq!(held.held_for, Duration::from_secs(4), "the oldest counts");
    assert_eq!(fleet.engine.activity(fleet.now, JobId::Experiment(ExperimentId(9))).batch, None);
}

#[test]
fn idle_share_is_the_time_slots_did_not_compute() {
    let mut fleet = Fleet::new();
    let id = fleet.join(2);
    fleet.start(EXPERIMENT, 1, 1);
    fleet.now += Duration::from_millis(20);
    fleet.step(id);
    let (_, evaluated) = &fleet.evaluated[0];
    assert_eq!(evaluated.duration, Duration::from_millis(20));
    assert!((evaluated.idle_share - 0.75).abs() < 1e-9, "{}", evaluated.idle_share);
}

#[test]
fn ten_thousand_workers_share_a_generation() {
    let mut fleet = Fleet::new();
    let ids: Vec<WorkerId> =
        (0..10_000).map(|_| fleet.engine.on_worker_joined(fleet.now, introduction(1))).collect();
    fleet.workers = ids.iter().map(|&id| (id, FakeWorker::default())).collect();
    fleet.start(EXPERIMENT, 10_000, 1);
    assert!(fleet.workers.values().all(|worker| worker.assignments.len() == 1));
}

//! A fleet that is divided among experiments: workers take only some names.

use std::collections::BTreeMap;

use engine::EngineConfig;
use model::ids::{ExperimentId, JobId, WorkerId};
use proptest::prelude::*;

use super::numbers::{Ask as _, SimulatedFleet, simulated};
use super::{HOUR, LEASE, MODEL, SECOND, assert_right, auditing_fleet, fleet, is_finished};

fn experiment(number: u64) -> JobId {
    JobId::Experiment(ExperimentId(number))
}

/// The jobs of each worker's items, from the timeline.
fn jobs_of(fleet: &SimulatedFleet) -> BTreeMap<WorkerId, Vec<JobId>> {
    let mut jobs: BTreeMap<WorkerId, Vec<JobId>> = BTreeMap::new();
    for entry in fleet.timeline() {
        jobs.entry(entry.worker).or_default().push(entry.job);
    }
    jobs
}

#[test]
fn a_worker_computes_no_experiment_whose_name_it_does_not_take() {
    let mut fleet = fleet();
    let reserved = fleet.join_for("experiment-1", 1.0);
    let free = fleet.join(1, 1.0);
    for number in [1, 2] {
        fleet.submit(experiment(number), 100);
        fleet.ask(experiment(number), 0, 50, 2);
    }
    assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() == 2));
    assert_right(&fleet, 50, 2);
    let jobs = jobs_of(&fleet);
    assert!(jobs[&reserved].iter().all(|&job| job == experiment(1)), "{jobs:?}");
    assert!(jobs[&free].contains(&experiment(2)), "{jobs:?}");
}

#[test]
fn an_experiment_that_no_worker_takes_holds_up_no_other_and_says_so() {
    let mut fleet = fleet();
    fleet.join_for("experiment-2", 1.0);
    for number in [1, 2] {
        fleet.submit(experiment(number), 100);
        fleet.ask(experiment(number), 0, 20, 2);
    }
    assert!(fleet.run_until(HOUR, is_finished));
    assert_eq!(fleet.evaluated[0].0, experiment(2));
    let activity = fleet.activity(experiment(1));
    assert_eq!((activity.n_workers_available, activity.n_workers_of_others), (0, 1));
    assert_eq!(activity.batch.map(|batch| batch.n_items_queued), Some(20));

    fleet.join_for("experiment-?", 1.0);
    assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() == 2));
    assert_eq!(fleet.evaluated[1].0, experiment(1));
    assert_right(&fleet, 20, 2);
}

#[test]
fn a_job_that_waited_for_a_worker_has_saved_up_no_time() {
    let mut fleet = fleet();
    let reserved = fleet.join_for("experiment-2", 1.0);
    for number in [1, 2] {
        fleet.submit(experiment(number), 100);
        fleet.ask(experiment(number), 0, 2000, 2);
    }
    fleet.run_for(60 * SECOND);
    fleet.join(1, 1.0);
    fleet.kill(reserved);
    let left = |fleet: &SimulatedFleet, number| {
        fleet.activity(experiment(number)).batch.map_or(0, |batch| batch.n_episodes_left)
    };
    let before = [1, 2].map(|number| left(&fleet, number));
    fleet.run_for(30 * SECOND);
    let done = [before[0] - left(&fleet, 1), before[1] - left(&fleet, 2)];
    assert!(done[0] > 0 && done[0].abs_diff(done[1]) * 10 < done[1], "{done:?}");
}

#[test]
fn an_audit_that_no_second_worker_may_do_is_waived() {
    let mut fleet = auditing_fleet(1.0);
    fleet.join_for("experiment-1", 1.0);
    fleet.join_for("experiment-2", 1.0);
    fleet.join_for("experiment-2", 1.0);
    fleet.submit(experiment(1), 100);
    fleet.ask(experiment(1), 0, 10, 2);
    assert!(fleet.run_until(HOUR, is_finished));
    let (_, evaluated) = &fleet.evaluated[0];
    assert!(evaluated.n_audited == 0 && evaluated.n_unaudited >= 10, "{evaluated:?}");
    assert_right(&fleet, 10, 2);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Whatever the patterns of workers, every experiment that a worker takes is completed to the
    /// same values, and only by workers that take it.
    #[test]
    fn every_experiment_that_somebody_takes_is_completed(
        patterns in prop::collection::vec("(\\*|experiment-[1-3?])", 1..6),
        audit in any::<bool>(),
        n_kills in 0_usize..4,
    ) {
        let audit_fraction = f64::from(u8::from(audit)) * 0.3;
        let config = EngineConfig { audit_fraction, ..EngineConfig::new(LEASE) };
        let mut fleet = simulated(MODEL, config);
        let takes = |pattern: &str, number: u64| {
            pattern == "*" || pattern.ends_with('?') || pattern.ends_with(&number.to_string())
        };
        let taken: Vec<u64> =
            (1..=3).filter(|&n| patterns.iter().any(|pattern| takes(pattern, n))).collect();
        let workers: BTreeMap<WorkerId, &String> = (0..)
            .zip(&patterns)
            .map(|(i, pattern)| (fleet.join_for(pattern, 0.5 + f64::from(i) / 4.0), pattern))
            .collect();
        for number in 1..=3 {
            fleet.submit(experiment(number), 100);
            fleet.ask(experiment(number), 0, 12, 2);
        }
        for (&id, _) in workers.iter().take(n_kills) {
            fleet.run_for(SECOND);
            fleet.restart(id);
        }
        prop_assert!(fleet.run_until(HOUR, |fleet| fleet.evaluated.len() == taken.len()));
        fleet.engine.sanity_check();
        assert_right(&fleet, 12, 2);
        for (worker, jobs) in jobs_of(&fleet) {
            let Some(pattern) = workers.get(&worker) else { continue };
            for job in jobs {
                let JobId::Experiment(ExperimentId(number)) = job else { unreachable!() };
                prop_assert!(takes(pattern, number), "{pattern} was given experiment {number}");
            }
        }
    }
}

//! Worker faults, one rule at a time: the referee and other workers settle them by proof.

use engine::{Assignment, EngineConfig};
use model::ids::{ExperimentId, JobId, WorkerId};

use super::by_hand::{assert_evaluated, plain_fleet, start};
use super::numbers::{Ask as _, SimulatedFleet, fitness, simulated};
use super::{EXPERIMENT, LEASE, MODEL, SECOND, assert_right, fleet};
use simulated_fleet::Conduct;

#[test]
fn silence_and_goodbyes_are_no_evidence_against_items() {
    let mut fleet = plain_fleet();
    start(&mut fleet, EXPERIMENT, 1, 1);
    for _ in 0..6 {
        let silent = fleet.join_by_hand(1);
        fleet.silence(silent);
        fleet.run_for(LEASE + SECOND);
        assert!(fleet.worker_ids().is_empty());
        let leaving = fleet.join_by_hand(1);
        fleet.drain(leaving);
        fleet.kill(leaving);
        fleet.run_for(2 * SECOND);
    }
    assert_eq!(fleet.n_questions, 0);
    let id = fleet.join_by_hand(1);
    fleet.drain(id);
    fleet.step(id);
    assert_evaluated(&fleet, 1, 1);
    fleet.ask(EXPERIMENT, 1, 1, 1);
    assert!(fleet.assigned(id).is_empty(), "a worker that leaves gets nothing more");
}

#[test]
fn the_referee_computes_an_item_that_takes_workers_down_and_no_worker_gets_it_meanwhile() {
    let mut fleet = plain_fleet();
    start(&mut fleet, EXPERIMENT, 1, 1);
    let mut id = fleet.join_by_hand(1);
    for n_losses in 1..=2 {
        assert_eq!((fleet.assigned(id).len(), fleet.n_questions), (1, 0), "{n_losses}");
        fleet.run_for(2 * SECOND);
        id = fleet.restart(id).unwrap();
    }
    assert_eq!((fleet.assigned(id).len(), fleet.n_questions), (0, 1));
    fleet.run_for(SECOND);
    // Something else killed the workers, since the referee has computed the item.
    assert_evaluated(&fleet, 1, 1);
    assert!(fleet.failed.is_empty() && fleet.quarantined.is_empty());
}

#[test]
fn a_poisonous_item_fails_its_experiment_by_name_and_no_other() {
    let mut fleet = plain_fleet();
    let other = JobId::Experiment(ExperimentId(2));
    fleet.work.poisonous.insert(0);
    start(&mut fleet, EXPERIMENT, 1, 1);
    let mut id = fleet.join_by_hand(1);
    for _ in 0..2 {
        fleet.run_for(2 * SECOND);
        id = fleet.restart(id).unwrap();
    }
    fleet.run_for(15 * SECOND);
    assert_eq!(fleet.failed.len(), 1);
    let (failed, reason) = &fleet.failed[0];
    assert_eq!(*failed, EXPERIMENT);
    assert!(reason.contains("individual 0 of generation 0"), "{reason}");
    assert_eq!(fleet.n_questions, 3, "one death may be chance");
    fleet.work.poisonous.clear();
    start(&mut fleet, other, 5, 1);
    fleet.run_by_hand();
    assert_eq!(fleet.evaluated[0].0, other);
}

#[test]
fn copies_that_are_lost_at_the_same_moment_are_one_loss() {
    let mut fleet = fleet();
    let ids: Vec<WorkerId> = (0..6).map(|_| fleet.join_by_hand(1)).collect();
    start(&mut fleet, EXPERIMENT, 6, 1);
    for _ in 0..3 {
        fleet.run_for(SECOND);
        fleet.step(ids[0]);
        fleet.step(ids[1]);
    }
    for id in ids {
        fleet.kill(id);
    }
    assert_eq!(fleet.n_questions, 0);
    fleet.join_by_hand(1);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 6, 1);
}

#[test]
fn items_that_wait_in_a_lost_worker_are_not_suspects() {
    let mut fleet = plain_fleet();
    start(&mut fleet, EXPERIMENT, 2, 1);
    // One slot, two credits: individual 0 is computed, 1 waits.
    let id = fleet.join_by_hand(1);
    assert_eq!(fleet.assigned(id).len(), 2);
    fleet.kill(id);
    assert_eq!(fleet.activity(EXPERIMENT).batch.unwrap().n_individuals_failing, 1);
}

#[test]
fn a_failure_that_the_referee_sees_too_fails_the_experiment_at_once() {
    let mut fleet = fleet();
    fleet.work.failing.insert(0);
    let id = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 1, 1);
    let assignment = fleet.assigned(id)[0].id;
    fleet.answer(id, assignment, Err("it overflowed".to_owned()));
    fleet.run_for(SECOND);
    assert!(fleet.failed[0].1.contains("it overflowed"), "{:?}", fleet.failed);
    assert!(fleet.quarantined.is_empty(), "the worker is not to blame");
    start(&mut fleet, JobId::Experiment(ExperimentId(2)), 1, 1);
    assert_eq!(fleet.assigned(id).len(), 1);
}

#[test]
fn a_failure_that_the_referee_contradicts_puts_its_reporter_in_quarantine() {
    let mut fleet = fleet();
    let (liar, honest) = (fleet.join_by_hand(2), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 5, 1);
    for assignment in fleet.assigned(liar) {
        fleet.answer(liar, assignment.id, Err("I cannot".to_owned()));
    }
    assert_eq!(fleet.n_questions, 1, "one is enough");
    fleet.run_for(SECOND);
    assert_eq!(fleet.quarantined.len(), 1);
    let (name, reason) = &fleet.quarantined[0];
    assert!(name == "worker-1" && reason.contains("I cannot"), "{reason}");
    // It is recognised when it reconnects.
    let liar = fleet.restart(liar).unwrap();
    assert!(fleet.assigned(liar).is_empty() && fleet.status()[1].quarantined.is_some());
    while fleet.step(honest) {}
    assert_evaluated(&fleet, 5, 1);
    // An operator has mended it.
    fleet.ask(EXPERIMENT, 1, 5, 1);
    fleet.tell(|engine, now| assert!(engine.on_readmitted(now, "worker-1")));
    fleet.run_for(SECOND);
    assert!(!fleet.assigned(liar).is_empty());
    fleet.tell(|engine, now| assert!(!engine.on_readmitted(now, "worker-1")));
}

#[test]
fn one_of_two_workers_in_quarantine_for_the_same_reason_is_readmitted_and_the_other_is_not() {
    let mut fleet = fleet();
    let workers = [fleet.join_by_hand(1), fleet.join_by_hand(1)];
    start(&mut fleet, EXPERIMENT, 4, 2);
    for id in workers {
        let assignment = fleet.assigned(id)[0].id;
        fleet.answer(id, assignment, Ok(vec![1.0]));
    }
    let reasons = fleet.status().into_iter().map(|worker| worker.quarantined.unwrap());
    let reasons: Vec<String> = reasons.collect();
    assert_eq!(reasons[0], reasons[1]);
    fleet.tell(|engine, now| assert!(engine.on_readmitted(now, "worker-1")));
    let quarantined = fleet.status().into_iter().filter(|worker| worker.quarantined.is_some());
    assert_eq!(quarantined.map(|worker| worker.id).collect::<Vec<_>>(), [workers[1]]);
}

#[test]
fn without_a_referee_workers_with_most_of_the_slots_confirm_a_failure() {
    let mut fleet = fleet();
    fleet.work.has_referee = false;
    let (first, second) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 1, 1);
    let assignment = fleet.assigned(first)[0].id;
    fleet.answer(first, assignment, Err("it overflowed".to_owned()));
    fleet.run_for(SECOND);
    assert!(fleet.failed.is_empty());
    let assignment = fleet.assigned(second)[0].id;
    fleet.answer(second, assignment, Err("it overflowed".to_owned()));
    assert_eq!(fleet.failed.len(), 1);
}

#[test]
fn without_a_referee_workers_with_fewer_slots_confirm_no_failure() {
    let mut fleet = fleet();
    fleet.work.has_referee = false;
    let liars = [fleet.join_by_hand(1), fleet.join_by_hand(1)];
    let honest = fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 1, 1);
    for _ in 0..10 {
        for liar in liars {
            for assignment in fleet.assigned(liar) {
                fleet.answer(liar, assignment.id, Err("I cannot".to_owned()));
            }
        }
        fleet.run_for(SECOND);
    }
    assert!(fleet.failed.is_empty(), "{:?}", fleet.failed);
    while fleet.step(honest) {}
    assert_evaluated(&fleet, 1, 1);
}

/// A worker that joined by hand returns NaN for all of its items.
fn find_no_fitness(fleet: &mut SimulatedFleet, id: WorkerId) {
    while let Some(assignment) = fleet.assigned(id).first() {
        let values = vec![f64::NAN; assignment.trials.len()];
        fleet.answer(id, assignment.id, Ok(values));
    }
}

#[test]
fn a_worker_is_not_believed_that_no_individual_has_a_finite_fitness() {
    let mut fleet = fleet();
    let liar = fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 20, 2);
    find_no_fitness(&mut fleet, liar);
    assert!(fleet.evaluated.is_empty());
    fleet.run_for(SECOND);
    assert_eq!((fleet.n_questions, fleet.quarantined.len()), (1, 1));
    fleet.join_by_hand(2);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 20, 2);
}

#[test]
fn the_referee_is_believed_that_no_individual_has_a_finite_fitness() {
    let mut fleet = fleet();
    fleet.work.has_no_fitness = true;
    let id = fleet.join_by_hand(2);
    start(&mut fleet, EXPERIMENT, 20, 2);
    find_no_fitness(&mut fleet, id);
    fleet.run_for(10 * SECOND);
    assert!(fleet.quarantined.is_empty());
    let (_, evaluated) = &fleet.evaluated[0];
    assert!(evaluated.values.iter().flatten().all(|value| value.is_nan()));
    assert_eq!(fleet.n_questions, 8);
}

#[test]
fn failures_of_the_same_individual_in_two_generations_do_not_confirm_each_other() {
    let mut fleet = fleet();
    fleet.work.has_referee = false;
    let workers = [(); 3].map(|()| fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 1, 1);
    for generation in 0..2 {
        let mut holders = workers.iter().filter(|&&id| !fleet.assigned(id).is_empty());
        let reporter = *holders.next().unwrap();
        let assignment = fleet.assigned(reporter)[0].id;
        fleet.answer(reporter, assignment, Err("it overflowed".to_owned()));
        fleet.run_for(SECOND);
        fleet.run_by_hand();
        assert_eq!((fleet.evaluated.len(), fleet.failed.len()), (generation + 1, 0));
        fleet.ask(EXPERIMENT, generation as u64 + 1, 1, 1);
    }
}

#[test]
fn without_a_referee_work_goes_on_and_the_question_stays_open() {
    let mut fleet = fleet();
    fleet.work.has_referee = false;
    let (liar, honest) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 4, 1);
    let assignment = fleet.assigned(liar)[0].id;
    fleet.answer(liar, assignment, Err("I cannot".to_owned()));
    fleet.run_for(SECOND);
    while fleet.step(honest) {}
    fleet.run_for(30 * SECOND);
    while fleet.step(honest) {}
    assert_evaluated(&fleet, 4, 1);
    assert!(fleet.quarantined.is_empty());
    fleet.work.has_referee = true;
    fleet.run_for(70 * SECOND);
    assert_eq!(fleet.quarantined.len(), 1);
}

#[test]
fn a_result_of_the_wrong_length_is_proof_enough() {
    let mut fleet = fleet();
    let id = fleet.join_by_hand(1);
    start(&mut fleet, EXPERIMENT, 1, 2);
    let assignment = fleet.assigned(id)[0].id;
    fleet.answer(id, assignment, Ok(vec![1.0]));
    assert!(fleet.assigned(id).is_empty() && fleet.evaluated.is_empty());
    assert!(fleet.quarantined[0].1.contains("1 values for 2 trials"), "{:?}", fleet.quarantined);
}

/// Three workers with an item each. The first has finished its own, and has got a copy of the
/// third's, which is late.
fn fleet_with_a_late_item() -> (SimulatedFleet, [WorkerId; 3], Assignment) {
    let mut fleet = fleet();
    let workers = [fleet.join_by_hand(1), fleet.join_by_hand(1), fleet.join_by_hand(1)];
    start(&mut fleet, EXPERIMENT, 3, 1);
    let late = fleet.assigned(workers[2])[0].clone();
    fleet.run_for(SECOND / 10);
    fleet.step(workers[0]);
    fleet.run_for(SECOND / 2);
    let copy = &fleet.assigned(workers[0])[0];
    assert_eq!((&copy.genotype, &copy.trials), (&late.genotype, &late.trials));
    (fleet, workers, late)
}

#[test]
fn the_first_of_two_results_wins_and_the_other_worker_drops_the_item() {
    let (mut fleet, [first, _, third], late) = fleet_with_a_late_item();
    fleet.step(first);
    assert!(fleet.assigned(third).iter().all(|assignment| assignment.id != late.id));
    // Its answer was already on its way.
    fleet.answer(third, late.id, Ok(vec![fitness(&late.genotype, 0)]));
    assert_eq!(fleet.n_questions, 0);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 3, 1);
}

#[test]
fn a_late_result_that_differs_is_settled_by_the_referee() {
    let (mut fleet, [first, second, third], late) = fleet_with_a_late_item();
    fleet.step(first);
    fleet.answer(third, late.id, Ok(vec![-1.0]));
    assert_eq!(fleet.n_questions, 1);
    fleet.run_for(SECOND);
    let quarantined = fleet.status().into_iter().filter(|worker| worker.quarantined.is_some());
    assert_eq!(quarantined.map(|worker| worker.id).collect::<Vec<_>>(), [third]);
    assert!(fleet.step(second) || fleet.step(first));
    fleet.run_by_hand();
    assert_evaluated(&fleet, 3, 1);
}

#[test]
fn results_of_a_liar_are_computed_again() {
    let config = EngineConfig { audit_fraction: 1.0, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(MODEL, config);
    let (liar, honest) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 4, 1);
    for assignment in fleet.assigned(liar) {
        fleet.answer(liar, assignment.id, Ok(vec![-1.0]));
    }
    while fleet.quarantined.is_empty() {
        fleet.step(honest);
        fleet.run_for(SECOND / 10);
    }
    assert_eq!(fleet.quarantined[0].0, "worker-1");
    fleet.run_by_hand();
    assert!(fleet.evaluated.is_empty(), "another auditor may come");
    fleet.run_for(30 * SECOND);
    assert_evaluated(&fleet, 4, 1);
}

#[test]
fn generations_that_a_liar_may_have_spoilt_are_named() {
    let config = EngineConfig { audit_fraction: 0.05, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(MODEL, config);
    let (liar, honest) = (fleet.join(1, 1.0), fleet.join(1, 1.0));
    fleet.submit(EXPERIMENT, 100);
    for generation in 0..4 {
        fleet.ask(EXPERIMENT, generation, 8, 1);
        assert!(fleet.run_until(60 * SECOND, |fleet| fleet.evaluated.len() as u64 > generation));
    }
    let last_confirmed = (0..4).rev().find(|&g| fleet.evaluated[g].1.n_audited > 0);
    fleet.set_conduct(liar, Conduct::Lies);
    fleet.ask(EXPERIMENT, 4, 200, 1);
    assert!(fleet.run_until(60 * SECOND, |fleet| fleet.evaluated.len() == 5));
    assert_right(&fleet, 200, 1);
    let first = last_confirmed.map_or(0, |g| g + 1);
    let expected = format!("in generations {first} to 3");
    let notices = &fleet.evaluated[4].1.notices;
    assert!(first < 4 && notices[0].contains(&expected), "{notices:?}, not {expected}");
    assert!(fleet.worker_ids().contains(&honest));
}

#[test]
fn a_worker_that_comes_back_after_a_loss_is_given_one_item_until_it_returns_something() {
    let mut fleet = plain_fleet();
    let (id, other) = (fleet.join_by_hand(8), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 40, 1);
    assert!(fleet.assigned(id).len() > 1);
    let id = fleet.restart(id).unwrap();
    assert!(fleet.assigned(id).is_empty(), "it waits, because another worker can compute");
    fleet.run_for(SECOND);
    assert_eq!(fleet.assigned(id).len(), 1);
    fleet.step(id);
    assert!(fleet.assigned(id).len() > 1);
    // It is the only worker.
    let id = fleet.restart(id).unwrap();
    fleet.drain(other);
    fleet.run_for(SECOND / 5);
    assert_eq!(fleet.assigned(id).len(), 1);
}

#[test]
fn a_worker_in_quarantine_is_promised_no_item() {
    let mut fleet = plain_fleet();
    let (faulty, _) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    fleet.engine.on_quarantine_restored("worker-1", "it lies");
    let again = fleet.restart(faulty).unwrap();
    let status = fleet.status().into_iter().find(|worker| worker.id == again).unwrap();
    assert_eq!((status.quarantined.as_deref(), status.waits), (Some("it lies"), None));
}

#[test]
fn a_worker_without_results_gets_nothing_until_it_returns_one() {
    let mut fleet = fleet();
    let (hung, other) = (fleet.join_by_hand(4), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 100, 1);
    let late = fleet.assigned(hung)[0].clone();
    for _ in 0..40 {
        fleet.run_for(SECOND / 10);
        fleet.step(other);
    }
    let status = fleet.status();
    assert!(status[0].waits.is_some() && status[1].waits.is_none(), "{status:?}");
    assert_eq!(status[0].n_in_flight, 0, "other workers have its items");
    fleet.answer(hung, late.id, Ok(vec![fitness(&late.genotype, 0)]));
    assert!(fleet.status()[0].waits.is_none());
    assert!(fleet.status()[0].n_in_flight > 0);
    fleet.run_by_hand();
    assert_evaluated(&fleet, 100, 1);
}

#[test]
fn a_stalled_worker_is_served_again_when_its_items_are_no_longer_needed() {
    let mut fleet = fleet();
    let (hung, other) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 100, 1);
    for _ in 0..40 {
        fleet.run_for(SECOND / 10);
        fleet.step(other);
    }
    assert!(fleet.status()[0].waits.is_some());
    fleet.tell(|engine, now| engine.on_job_ended(now, EXPERIMENT));
    start(&mut fleet, JobId::Experiment(ExperimentId(2)), 100, 1);
    assert!(fleet.status()[0].waits.is_none() && !fleet.assigned(hung).is_empty());
}

#[test]
fn the_death_of_the_referee_is_no_proof_against_workers_that_were_not_lost() {
    let mut fleet = fleet();
    let (reporter, other) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    start(&mut fleet, EXPERIMENT, 4, 1);
    let reported = fleet.assigned(reporter)[0].clone();
    fleet.work.poisonous.insert(reported.genotype[0] as u64);
    fleet.answer(reporter, reported.id, Err("out of memory".to_owned()));
    fleet.run_for(60 * SECOND);
    while fleet.step(other) {}
    assert_evaluated(&fleet, 4, 1);
    assert!(fleet.failed.is_empty() && fleet.quarantined.is_empty());
}

#[test]
fn an_item_computed_by_two_is_audited_in_parts_by_others() {
    let config = EngineConfig { audit_fraction: 1.0, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(MODEL, config);
    fleet.submit(EXPERIMENT, 100);
    fleet.ask(EXPERIMENT, 0, 1, 5);
    let faulty = fleet.join_by_hand(1);
    let whole = fleet.assigned(faulty)[0].clone();
    assert_eq!(whole.trials, 0..5);
    let other = fleet.join_by_hand(2);
    // Without any result, the duration of an item is unknown; it counts as late after a while.
    fleet.run_for(6 * SECOND);
    let copies = fleet.assigned(other);
    assert_eq!(copies[0].trials.start, 0);
    fleet.step(other);
    let values =
        whole.trials.map(|trial| fitness(&whole.genotype, trial) + f64::from(u8::from(trial == 4)));
    fleet.answer(faulty, whole.id, Ok(values.collect()));
    for _ in 0..100 {
        fleet.run_for(SECOND / 2);
        fleet.step(other);
        // It computes its audits correctly.
        let rest = fleet.assigned(faulty);
        assert!(rest.iter().all(|assignment| !assignment.trials.contains(&4)), "its own");
        fleet.step(faulty);
    }
    assert_evaluated(&fleet, 1, 5);
    assert_eq!(fleet.quarantined[0].0, "worker-1");
}

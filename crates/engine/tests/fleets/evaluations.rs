//! Evaluations: batches of one genotype, whose trials give many numbers.

use std::ops::Range;

use engine::{Batch, EngineConfig};
use model::ids::{EvaluationId, JobId, WorkerId};
use sim_core::{Output, TrialSet};

use super::numbers::{Ask as _, SimulatedFleet, simulated};
use super::{EXPERIMENT, LEASE, MODEL, SECOND, fleet};

/// Number of values of a measured trial.
const N_VALUES: usize = 1001;
const EVALUATION: JobId = JobId::Evaluation(EvaluationId(1));

fn measures(trials: Range<u32>) -> Vec<f64> {
    let of_trial = |trial| (0..N_VALUES).map(move |place| f64::from(trial) + place as f64 / 1e4);
    trials.flat_map(of_trial).collect()
}

fn evaluate(fleet: &mut SimulatedFleet, n_trials: u32) {
    fleet.submit(EVALUATION, 100);
    let batch = Batch::measures(vec![0.5], n_trials, N_VALUES);
    fleet.tell(|engine, now| engine.on_batch_requested(now, EVALUATION, batch));
}

/// The worker's oldest item, which is one of an evaluation, is computed.
fn measure(fleet: &mut SimulatedFleet, id: WorkerId) -> bool {
    let Some(assignment) = fleet.assigned(id).into_iter().next() else { return false };
    let values = measures(assignment.trials.clone());
    assert!(values.len() <= 1 << 16, "an answer of {} numbers", values.len());
    fleet.answer_with(id, assignment.id, Output::Measures, Ok(values));
    true
}

#[test]
fn an_evaluation_has_one_genotype_and_many_numbers_per_trial() {
    let mut fleet = fleet();
    evaluate(&mut fleet, 200);
    let [first, second, victim] = [1, 2, 1].map(|n_slots| fleet.join_by_hand(n_slots));
    assert!(measure(&mut fleet, first));
    fleet.kill(victim);
    while fleet.evaluated.is_empty() {
        assert!(measure(&mut fleet, second) | measure(&mut fleet, first));
    }
    let (evaluated_id, evaluated) = &fleet.evaluated[0];
    assert_eq!((*evaluated_id, evaluated.trial_set), (EVALUATION, TrialSet::Evaluation));
    assert_eq!(evaluated.values, [measures(0..200)]);
}

#[test]
fn a_worker_that_returns_too_few_or_too_many_measures_gets_nothing_more() {
    for n_wrong in [0, 1, N_VALUES - 1, 1_000_000] {
        let mut fleet = fleet();
        evaluate(&mut fleet, 3);
        let bad = fleet.join_by_hand(1);
        let assignment = fleet.assigned(bad)[0].id;
        fleet.answer_with(bad, assignment, Output::Measures, Ok(vec![0.0; n_wrong]));
        assert!(fleet.assigned(bad).is_empty(), "{n_wrong}");
        let good = fleet.join_by_hand(1);
        while measure(&mut fleet, good) {}
        assert_eq!(fleet.evaluated[0].1.values, [measures(0..3)]);
    }
}

#[test]
fn a_result_of_the_wrong_kind_is_proof_enough() {
    for is_evaluation in [true, false] {
        let mut fleet = fleet();
        if is_evaluation {
            evaluate(&mut fleet, 1);
        } else {
            fleet.submit(EXPERIMENT, 100);
            fleet.ask(EXPERIMENT, 0, 1, N_VALUES as u32);
        }
        let bad = fleet.join_by_hand(1);
        let assignment = fleet.assigned(bad)[0].id;
        let wrong = if is_evaluation { Output::Fitness } else { Output::Measures };
        fleet.answer_with(bad, assignment, wrong, Ok(measures(0..1)));
        assert!(fleet.assigned(bad).is_empty() && fleet.evaluated.is_empty(), "{is_evaluation}");
        assert_eq!(fleet.quarantined.len(), 1);
    }
}

#[test]
fn a_late_result_of_an_ended_batch_proves_nothing() {
    let mut fleet = fleet();
    let (late, other) = (fleet.join_by_hand(1), fleet.join_by_hand(1));
    fleet.submit(EXPERIMENT, 100);
    let genotypes = (0..100).map(|i| vec![f64::from(i)]).collect();
    let batch = Batch::described(TrialSet::Generation(0), genotypes, 1, 1);
    fleet.tell(|engine, now| engine.on_batch_requested(now, EXPERIMENT, batch));
    let unanswered = fleet.assigned(late)[0].id;
    while fleet.evaluated.is_empty() {
        fleet.run_for(SECOND / 10);
        if let Some(assignment) = fleet.assigned(other).into_iter().next() {
            let values = Ok(vec![assignment.genotype[0], 0.5]);
            fleet.answer_with(other, assignment.id, Output::Descriptors, values);
        }
    }
    assert!(fleet.status()[0].waits.is_some(), "its item was written off");
    let block = TrialSet::HeldOut { generation: 0, block: 0 };
    let candidates = Batch::fitness(block, vec![vec![1.0]].into(), 1);
    fleet.tell(|engine, now| engine.on_batch_requested(now, EXPERIMENT, candidates));
    fleet.answer_with(late, unanswered, Output::Descriptors, Ok(vec![0.0, 0.5]));
    assert!(fleet.quarantined.is_empty(), "{:?}", fleet.quarantined);
}

#[test]
fn measures_that_differ_in_one_bit_of_one_number_are_noticed() {
    a_difference_is_noticed(Output::Measures, |fleet| evaluate(fleet, 2));
}

#[test]
fn descriptors_that_differ_in_one_bit_are_noticed() {
    a_difference_is_noticed(Output::Descriptors, |fleet| {
        fleet.submit(EXPERIMENT, 100);
        let set = TrialSet::Generation(0);
        let batch = Batch::described(set, vec![vec![0.5]].into(), 2, N_VALUES - 1);
        fleet.tell(|engine, now| engine.on_batch_requested(now, EXPERIMENT, batch));
    });
}

/// Of two workers, one returns a wrong bit in the last number of an item.
fn a_difference_is_noticed(output: Output, request: impl Fn(&mut SimulatedFleet)) {
    let config = EngineConfig { audit_fraction: 1.0, ..EngineConfig::new(LEASE) };
    let mut fleet = simulated(MODEL, config);
    request(&mut fleet);
    let workers = [(); 2].map(|()| fleet.join_by_hand(1));
    for turn in 0.. {
        assert!(turn < 20, "nobody noticed");
        let worker = workers[turn % 2];
        let Some(assignment) = fleet.assigned(worker).into_iter().next() else { continue };
        let mut values = measures(assignment.trials.clone());
        if worker == workers[1] {
            let last = values.last_mut().unwrap();
            *last = f64::from_bits(last.to_bits() ^ 1);
        }
        fleet.answer_with(worker, assignment.id, output, Ok(values));
        if fleet.n_questions > 0 {
            break;
        }
    }
    let questioned = fleet.status().into_iter().filter(|worker| worker.waits.is_some());
    assert_eq!(questioned.count(), 2);
    assert!(fleet.evaluated.is_empty());
}

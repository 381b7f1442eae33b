//! Evaluations: generations of one, whose trials give many numbers.

use std::ops::Range;

use sim_core::Output;

use crate::ids::EvaluationId;

use super::{
    super::*,
    LEASE,
    fleet::{FakeWorker, Fleet, introduction},
};

/// Numbers of a measured trial.
const N_VALUES: usize = 1001;

fn measures(trials: Range<u32>) -> Vec<f64> {
    let of_trial = |trial| (0..N_VALUES).map(move |place| f64::from(trial) + place as f64 / 1e4);
    trials.flat_map(of_trial).collect()
}

impl Fleet {
    fn evaluate(&mut self, id: JobId, n_trials: u32) {
        self.engine.on_job_started(id, "spec".into(), Priority::default());
        let batch = Batch::measures(vec![0.5], n_trials, N_VALUES);
        self.engine.on_batch_requested(self.now, id, batch);
        self.carry_out();
    }

    /// The worker's oldest item, which is one of an evaluation, is computed.
    fn measure(&mut self, id: WorkerId) -> bool {
        let Some((_, assignment)) =
            self.workers.get_mut(&id).and_then(|w| w.assignments.pop_front())
        else {
            return false;
        };
        let values = measures(assignment.trials.clone());
        assert!(values.len() <= 1 << 16, "an answer of {} numbers", values.len());
        self.output = Output::Measures;
        self.answer(id, assignment.id, Ok(values));
        self.output = Output::Fitness;
        true
    }
}

#[test]
fn an_evaluation_is_a_generation_of_one_whose_trials_have_many_numbers() {
    let id = JobId::Evaluation(EvaluationId(1));
    let mut fleet = Fleet::new();
    fleet.evaluate(id, 200);
    let (first, second, victim) = (fleet.join(1), fleet.join(2), fleet.join(1));
    assert!(fleet.measure(first));
    fleet.kill(victim);
    while fleet.evaluated.is_empty() {
        assert!(fleet.measure(second) | fleet.measure(first));
        fleet.engine.sanity_check();
    }
    let (evaluated_id, evaluated) = &fleet.evaluated[0];
    assert_eq!((*evaluated_id, evaluated.trial_set), (id, TrialSet::Evaluation));
    assert_eq!(evaluated.values, [measures(0..200)]);
}

#[test]
fn a_worker_that_returns_too_few_or_too_many_measures_is_dropped() {
    for n_wrong in [0, 1, N_VALUES - 1, 1_000_000] {
        let id = JobId::Evaluation(EvaluationId(1));
        let mut fleet = Fleet::plain();
        fleet.evaluate(id, 3);
        let bad = fleet.join(1);
        let assignment = fleet.workers[&bad].assignments[0].1.id;
        fleet.output = Output::Measures;
        fleet.answer(bad, assignment, Ok(vec![0.0; n_wrong]));
        assert!(fleet.engine.worker_status(fleet.now).is_empty(), "{n_wrong}");
        let good = fleet.join(1);
        while fleet.measure(good) {}
        assert_eq!(fleet.evaluated[0].1.values, [measures(0..3)]);
    }
}

#[test]
fn a_worker_that_returns_measures_for_fitness_or_fitness_for_measures_is_dropped() {
    for is_evaluation in [true, false] {
        let mut fleet = Fleet::plain();
        if is_evaluation {
            fleet.evaluate(JobId::Evaluation(EvaluationId(1)), 1);
        } else {
            fleet.start(super::EXPERIMENT, 1, N_VALUES as u32);
        }
        let bad = fleet.join(1);
        let assignment = fleet.workers[&bad].assignments[0].1.id;
        fleet.output = if is_evaluation { Output::Fitness } else { Output::Measures };
        fleet.answer(bad, assignment, Ok(measures(0..1)));
        assert!(fleet.engine.worker_status(fleet.now).is_empty(), "{is_evaluation}");
        assert!(fleet.evaluated.is_empty());
    }
}

#[test]
fn measures_that_differ_in_one_bit_of_one_number_are_noticed() {
    let id = JobId::Evaluation(EvaluationId(1));
    let config = EngineConfig { audit_fraction: 1.0, ..EngineConfig::new(LEASE) };
    let mut fleet = Fleet::with(config);
    fleet.evaluate(id, 2);
    let names = ["a", "b"].map(|name| {
        let introduction = Introduction { name: name.to_owned(), ..introduction(1) };
        let worker = fleet.engine.on_worker_joined(fleet.now, introduction);
        fleet.workers.insert(worker, FakeWorker::default());
        fleet.carry_out();
        worker
    });
    let mut n_answered = 0;
    while fleet.paused.is_empty() {
        let worker = names[n_answered % 2];
        n_answered += 1;
        assert!(n_answered < 20, "nobody noticed");
        let Some((_, assignment)) = fleet.workers.get_mut(&worker).unwrap().assignments.pop_front()
        else {
            continue;
        };
        let mut values = measures(assignment.trials.clone());
        if worker == names[1] {
            let last = values.last_mut().unwrap();
            *last = f64::from_bits(last.to_bits() ^ 1);
        }
        fleet.output = Output::Measures;
        fleet.answer(worker, assignment.id, Ok(values));
    }
    assert_eq!(fleet.paused[0].0, id);
    assert!(fleet.paused[0].1.contains("of the evaluation"), "{}", fleet.paused[0].1);
}

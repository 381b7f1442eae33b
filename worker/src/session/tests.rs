//! Sessions with a coordinator that the test plays.

mod stage;

use std::{
    collections::BTreeSet,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering::Relaxed},
        mpsc as std_mpsc,
    },
};

use sim_core::TrialSet;
use swarm_proto::v1::work_request;
use tokio::net::TcpListener;

use super::*;
use crate::WorkerError;
use stage::{MakesEvaluators, Stage, job, of_experiment, serve};

const LONG: Duration = Duration::from_secs(3600);

/// Fitness that depends on every field of an assignment.
fn arithmetic(config_json: String) -> Evaluator {
    Arc::new(move |assignment, _| {
        let factor: f64 = config_json.parse().map_err(|_| format!("`{config_json}`?"))?;
        let sum: f64 = assignment.genotype.genes()?.iter().sum();
        let TrialSet::Generation(generation) = assignment.trial_set else {
            return Err(format!("{}?", assignment.trial_set));
        };
        let fitness = |trial| factor * sum / (generation + u64::from(trial)) as f64;
        Ok(Some(assignment.trials.clone().map(fitness).collect()))
    })
}

/// Evaluators that report when they start an item, wait for a permit, and then answer with the
/// item's number, unless they have been stopped.
fn gated() -> (impl MakesEvaluators, mpsc::UnboundedReceiver<u64>, std_mpsc::Sender<()>) {
    let (started, starts) = mpsc::unbounded_channel();
    let (permit, permits) = std_mpsc::channel();
    let permits = Arc::new(Mutex::new(permits));
    let gated = move |_| -> Evaluator {
        let (started, permits) = (started.clone(), Arc::clone(&permits));
        Arc::new(move |assignment, keep_going| {
            started.send(assignment.id).map_err(|error| error.to_string())?;
            permits.lock().unwrap().recv().map_err(|error| error.to_string())?;
            Ok(keep_going().then(|| vec![assignment.id as f64]))
        })
    };
    (gated, starts, permit)
}

fn fitness(result: &v1::ItemResult) -> &[f64] {
    match &result.outcome {
        Some(v1::item_result::Outcome::Fitness(fitness)) => &fitness.values,
        other => panic!("expected a fitness, not {other:?}"),
    }
}

fn failure(result: &v1::ItemResult) -> &str {
    match &result.outcome {
        Some(v1::item_result::Outcome::Failure(failure)) => &failure.message,
        other => panic!("expected a failure, not {other:?}"),
    }
}

#[tokio::test]
async fn a_worker_introduces_itself() {
    let mut stage = Stage::new(3, arithmetic).await;
    let hello = stage.conversation().await.welcome(LONG).await;
    assert_eq!(hello.protocol_version, swarm_proto::PROTOCOL_VERSION);
    assert_eq!(hello.sim_core_fingerprint, sim_core::FINGERPRINT);
    assert_eq!((hello.name.as_str(), hello.slots), ("ada", 3));
    assert_eq!(hello.version, env!("CARGO_PKG_VERSION"));
    assert_ne!(hello.process_id, 0);
    stage.end().await;
}

#[tokio::test]
async fn results_arrive_without_any_change_of_bits() {
    let mut stage = Stage::new(2, arithmetic).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "0.3").await;
    coordinator.send_assignments(1, 10..14).await;
    for (result, id) in coordinator.results(4).await.iter().zip(10..) {
        assert_eq!(result.assignment_id, id);
        let sum = 0.1 + 0.2 + id as f64;
        let expected = [0.3 * sum / 6.0, 0.3 * sum / 7.0].map(f64::to_bits);
        assert_eq!(fitness(result).iter().map(|x| x.to_bits()).collect::<Vec<_>>(), expected);
    }
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn genotypes_are_drawn_to_the_bit_from_the_distribution_of_their_generation() {
    let setup = evolution::Setup { seed: 3, ..evolution::Setup::new("SNES", 4) };
    let mut evolution = setup.start().unwrap();
    for _ in 0..5 {
        let generation = evolution.ask();
        let fitness: Vec<Vec<f64>> = generation.genotypes.iter().map(|g| vec![g[0]]).collect();
        evolution.tell(generation, &fitness).unwrap();
    }
    let drawn = |assignment_id, individual| v1::Assignment {
        assignment_id,
        first_trial: 1,
        trial_count: 1,
        individual: Some(individual),
        ..v1::Assignment::default()
    };
    let distribution = |bytes| v1::Distribution { job: job(1), distribution: bytes };
    let mut stage = Stage::new(1, |_| -> Evaluator {
        Arc::new(|assignment, _| Ok(Some(assignment.genotype.genes()?.into_owned())))
    })
    .await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send(Message::Assignments(of_experiment(1, vec![drawn(1, 7)]))).await;
    assert!(failure(&coordinator.results(1).await[0]).contains("no distribution of generation 5"));
    coordinator.send(Message::Distribution(distribution(evolution.distribution().unwrap()))).await;
    let assignments = vec![drawn(2, 7), drawn(3, 0), drawn(4, 20)];
    coordinator.send(Message::Assignments(of_experiment(1, assignments))).await;
    let results = coordinator.results(3).await;
    let asked = evolution.ask().genotypes;
    for (result, individual) in results.iter().zip([7, 0]) {
        let bits = |genes: &[f64]| genes.iter().map(|gene| gene.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(fitness(result)), bits(&asked[individual]));
    }
    assert_eq!(failure(&results[2]), "generation 5 has no individual 20");
    coordinator.send(Message::Distribution(distribution(vec![9]))).await;
    coordinator.send(Message::Assignments(of_experiment(1, vec![drawn(5, 7)]))).await;
    assert!(failure(&coordinator.results(1).await[0]).contains("no distribution of generation 5"));
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn an_item_that_cannot_be_computed_fails_alone() {
    fn panics_on_item_1(_: String) -> Evaluator {
        Arc::new(|assignment, _| match assignment.id {
            1 => panic!("division by swarm"),
            _ => Ok(Some(vec![1.0])),
        })
    }
    let mut stage = Stage::new(1, panics_on_item_1).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, [1, 2]).await;
    let results = coordinator.results(2).await;
    assert_eq!(failure(&results[0]), "panicked: division by swarm");
    assert_eq!(fitness(&results[1]), [1.0]);
    // An assignment without a specification, and one with too large trial numbers.
    coordinator.send_assignments(2, [3]).await;
    assert!(failure(&coordinator.results(1).await[0]).contains("experiment 2"));
    let endless = v1::Assignment {
        assignment_id: 4,
        first_trial: u32::MAX,
        trial_count: 2,
        genotype: vec![],
        individual: None,
    };
    coordinator.send(Message::Assignments(of_experiment(1, vec![endless]))).await;
    assert!(failure(&coordinator.results(1).await[0]).contains("trials"));
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn a_specification_that_does_not_parse_fails_its_items_with_the_reason() {
    let mut stage = Stage::new(1, arithmetic).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "three").await;
    coordinator.send_assignments(1, [1]).await;
    assert_eq!(failure(&coordinator.results(1).await[0]), "`three`?");
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn an_ended_experiment_is_forgotten() {
    let mut stage = Stage::new(1, arithmetic).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "1").await;
    coordinator.send_end(1).await;
    coordinator.send_assignments(1, [1]).await;
    assert!(failure(&coordinator.results(1).await[0]).contains("no specification"));
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn dropped_items_are_not_computed() {
    let (gated, mut starts, permit) = gated();
    let mut stage = Stage::new(1, gated).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, 1..=4).await;
    assert_eq!(starts.recv().await, Some(1));
    coordinator
        .send(Message::DropAssignments(v1::DropAssignments { assignment_ids: vec![2, 4, 99] }))
        .await;
    // The worker answers this at once, so it has read everything sent before.
    coordinator.send_assignments(9, [5]).await;
    assert_eq!(coordinator.results(1).await[0].assignment_id, 5);
    permit.send(()).unwrap();
    permit.send(()).unwrap();
    let computed = coordinator.results(2).await;
    assert_eq!(computed.iter().map(|result| result.assignment_id).collect::<Vec<_>>(), [1, 3]);
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn a_result_does_not_wait_for_the_end_of_the_next_item() {
    let (gated, mut starts, permit) = gated();
    let mut stage = Stage::new(1, gated).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, 1..=4).await;
    permit.send(()).unwrap();
    assert_eq!(coordinator.results(1).await[0].assignment_id, 1, "two more wait for the slot");
    assert_eq!((starts.recv().await, starts.recv().await), (Some(1), Some(2)));
    (0..3).for_each(|_| permit.send(()).unwrap());
    assert_eq!(coordinator.results(3).await.len(), 3);
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn items_in_progress_that_nobody_wants_are_stopped() {
    let drop_one = Message::DropAssignments(v1::DropAssignments { assignment_ids: vec![1] });
    let end = Message::EndJob(v1::EndJob { job: job(1) });
    for message in [drop_one, end] {
        let (gated, mut starts, permit) = gated();
        let mut stage = Stage::new(1, gated).await;
        let mut coordinator = stage.conversation().await;
        coordinator.welcome(LONG).await;
        coordinator.send_spec(1, "").await;
        coordinator.send_spec(2, "").await;
        coordinator.send_assignments(1, [1]).await;
        assert_eq!(starts.recv().await, Some(1));
        coordinator.send(message).await;
        coordinator.send_assignments(2, [2]).await;
        // The worker answers this at once, so it has read everything sent before.
        coordinator.send_assignments(9, [3]).await;
        assert_eq!(coordinator.results(1).await[0].assignment_id, 3);
        permit.send(()).unwrap();
        permit.send(()).unwrap();
        assert_eq!(coordinator.results(1).await[0].assignment_id, 2, "item 1 has no result");
        drop(coordinator);
        stage.end().await;
    }
}

#[tokio::test]
async fn a_broken_stream_is_opened_again() {
    let mut stage = Stage::new(1, arithmetic).await;
    let mut process_ids = BTreeSet::new();
    for _ in 0..3 {
        let mut coordinator = stage.conversation().await;
        let hello = coordinator.welcome(LONG).await;
        assert_eq!(hello.name, "ada");
        process_ids.insert(hello.process_id);
        coordinator.send_spec(1, "1").await;
        coordinator.send_assignments(1, [1]).await;
        coordinator.results(1).await;
    }
    assert_eq!(process_ids.len(), 1, "it keeps its process id");
    stage.end().await;
}

#[tokio::test]
async fn a_coordinator_that_comes_up_late_is_found() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let stage = Stage::worker(address, 1, arithmetic);
    let mut stage =
        Stage { conversations: serve(TcpListener::bind(address).await.unwrap()), ..stage };
    stage.conversation().await.welcome(LONG).await;
    stage.end().await;
}

#[tokio::test]
async fn a_version_mismatch_is_fatal_and_any_other_refusal_is_not() {
    let mut stage = Stage::new(1, arithmetic).await;
    for status in [Status::unavailable("shutting down"), Status::failed_precondition("I am 9.9")] {
        let coordinator = stage.conversation().await;
        coordinator.responses.send(Err(status)).await.unwrap();
    }
    let error = stage.worker.await.unwrap().unwrap_err();
    assert!(
        matches!(&error, WorkerError::VersionMismatch { refusal, .. } if refusal == "I am 9.9")
    );
}

#[tokio::test]
async fn a_stopping_worker_delivers_only_its_items_in_progress() {
    let (gated, mut starts, permit) = gated();
    let mut stage = Stage::new(1, gated).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, [1, 2]).await;
    assert_eq!(starts.recv().await, Some(1));
    stage.shutdown.cancel();
    assert!(matches!(coordinator.next().await, Some(work_request::Message::Draining(_))));
    // Sent before the coordinator knew of the draining.
    coordinator.send_assignments(1, [3]).await;
    permit.send(()).unwrap();
    assert_eq!(fitness(&coordinator.results(1).await[0]), [1.0]);
    assert_eq!(coordinator.next().await, None);
    drop(coordinator);
    stage.worker.await.unwrap().unwrap();
}

#[tokio::test]
async fn a_worker_that_gives_up_drops_items_of_scripts_and_finishes_others() {
    let (start, mut starts) = mpsc::unbounded_channel();
    let dropped = Arc::new(AtomicBool::new(false));
    // The script's item ends when it is dropped; the other one ends after that.
    let evaluator = move |config_json: String| -> Evaluator {
        let (start, dropped) = (start.clone(), Arc::clone(&dropped));
        let is_script = config_json.contains("script");
        Arc::new(move |assignment, keep_going| {
            start.send(()).unwrap();
            while if is_script { keep_going() } else { !dropped.load(Relaxed) } {
                std::thread::yield_now();
            }
            dropped.store(true, Relaxed);
            Ok(keep_going().then(|| vec![assignment.id as f64]))
        })
    };
    let mut stage = Stage::new(2, evaluator).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, r#"{"task": {"script": {}}}"#).await;
    coordinator.send_spec(2, "{}").await;
    coordinator.send_assignments(1, [1]).await;
    coordinator.send_assignments(2, [2]).await;
    assert_eq!((starts.recv().await, starts.recv().await), (Some(()), Some(())));
    stage.shutdown.cancel();
    assert!(matches!(coordinator.next().await, Some(work_request::Message::Draining(_))));
    stage.give_up.cancel();
    assert_eq!(coordinator.results(1).await[0].assignment_id, 2);
    assert_eq!(coordinator.next().await, None, "dropped items have no results");
    drop(coordinator);
    stage.worker.await.unwrap().unwrap();
}

#[tokio::test]
async fn heartbeats_go_on_while_all_slots_compute() {
    let (gated, mut starts, permit) = gated();
    let mut stage = Stage::new(1, gated).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(Duration::from_millis(5)).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, [1]).await;
    assert_eq!(starts.recv().await, Some(1));
    for _ in 0..3 {
        assert!(matches!(coordinator.next().await, Some(work_request::Message::Heartbeat(_))));
    }
    permit.send(()).unwrap();
    drop(coordinator);
    stage.end().await;
}

#[tokio::test]
async fn more_items_than_the_credit_allows_are_failed() {
    let (gated, mut starts, permit) = gated();
    let mut stage = Stage::new(1, gated).await;
    let mut coordinator = stage.conversation().await;
    coordinator.welcome(LONG).await;
    coordinator.send_spec(1, "").await;
    coordinator.send_assignments(1, [1]).await;
    assert_eq!(starts.recv().await, Some(1));
    let n_queued = model::limits::ITEMS_PER_SLOT_MAX as u64;
    coordinator.send_assignments(1, 2..n_queued + 4).await;
    let results = coordinator.results(2).await;
    assert!(results.iter().all(|result| failure(result).contains("queued")));
    let failed: BTreeSet<u64> = results.iter().map(|result| result.assignment_id).collect();
    assert_eq!(failed, BTreeSet::from([n_queued + 2, n_queued + 3]));
    for _ in 0..=n_queued {
        permit.send(()).unwrap();
    }
    drop(coordinator);
    stage.end().await;
}

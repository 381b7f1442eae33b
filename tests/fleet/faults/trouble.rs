//! Workers that fail, lie, hang and crash in loops beside honest ones: no experiment ends, and no
//! bit changes.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
    time::Duration,
};

use harness::{CoordinatorProcess, Experiment, HandWorker, WorkerProcess, hello, undisturbed};
use swarm_proto::v1::{
    Assignment, Heartbeat, Hello, ItemFailure, ItemResult, ItemResults, item_result::Outcome,
    work_request::Message, work_response,
};

use super::{OTHER, SMALL, TINY};

/// A worker's answer to an assignment; `None` for no answer.
type Conduct = fn(&Assignment) -> Option<ItemResult>;

fn fails(assignment: &Assignment) -> Option<ItemResult> {
    let failure = ItemFailure { message: "the wheels\ncame off".to_owned() };
    let outcome = Some(Outcome::Failure(failure));
    Some(ItemResult { assignment_id: assignment.assignment_id, outcome, compute_us: 1 })
}

fn says_nothing_of_substance(assignment: &Assignment) -> Option<ItemResult> {
    Some(ItemResult { assignment_id: assignment.assignment_id, outcome: None, compute_us: 1 })
}

fn lies(assignment: &Assignment) -> Option<ItemResult> {
    let values = vec![0.125; assignment.trial_count as usize];
    let outcome = Some(Outcome::Fitness(swarm_proto::v1::TrialFitness { values }));
    Some(ItemResult { assignment_id: assignment.assignment_id, outcome, compute_us: 1 })
}

fn hangs(_: &Assignment) -> Option<ItemResult> {
    None
}

/// A worker that stays for ever, and reconnects whenever it is dropped.
fn spawn_worker(coordinator: &CoordinatorProcess, name: &str, slots: u32, conduct: Conduct) {
    let (url, hello) = (coordinator.url(), Hello { name: name.to_owned(), slots, ..hello() });
    tokio::spawn(async move {
        while let Ok(mut worker) = HandWorker::connect(&url, hello.clone()).await {
            let mut heart = tokio::time::interval(Duration::from_secs(1));
            loop {
                tokio::select! {
                    _ = heart.tick() => worker.say(Message::Heartbeat(Heartbeat {})).await,
                    message = worker.receive() => {
                        let Ok(message) = message else { break };
                        let work_response::Message::Assignments(batch) = message else { continue };
                        let results = batch.assignments.iter().filter_map(conduct).collect();
                        worker.say(Message::Results(ItemResults { results })).await;
                    }
                }
            }
        }
    });
}

fn wait_until_joined(coordinator: &CoordinatorProcess, name: &str) {
    coordinator
        .process
        .wait_for("worker", |line| line["message"] == "worker joined" && line["name"] == name);
}

/// Names of the workers in quarantine, and the reasons.
fn quarantined(coordinator: &CoordinatorProcess) -> Vec<(String, String)> {
    let lines = coordinator.process.lines();
    let faulty = lines.iter().filter(|line| {
        line["message"].as_str().is_some_and(|message| message.starts_with("worker is faulty"))
    });
    let text = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    faulty.map(|line| (text(&line["name"]), text(&line["reason"]))).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_fails_every_item_ends_up_in_quarantine_and_no_experiment_fails() {
    for (conduct, words) in
        [(fails as Conduct, "the wheels came off"), (says_nothing_of_substance, "no outcome")]
    {
        let coordinator = CoordinatorProcess::start();
        spawn_worker(&coordinator, "broken", 4, conduct);
        wait_until_joined(&coordinator, "broken");
        let ids = [TINY.submit(&coordinator), OTHER.submit(&coordinator)];
        let _honest = WorkerProcess::start(&coordinator, "honest");
        TINY.assert_undisturbed(coordinator.watch(ids[0]));
        OTHER.assert_undisturbed(coordinator.watch(ids[1]));
        let [(name, reason)] = &quarantined(&coordinator)[..] else {
            panic!("{:?}", quarantined(&coordinator))
        };
        assert!(name == "broken" && reason.contains(words), "{reason}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn hung_workers_with_most_of_the_slots_do_not_stop_two_honest_ones() {
    let coordinator = CoordinatorProcess::start();
    for name in ["hung-1", "hung-2"] {
        spawn_worker(&coordinator, name, 64, hangs);
        wait_until_joined(&coordinator, name);
    }
    let id = TINY.submit(&coordinator);
    let _honest = WorkerProcess::start_many(&coordinator, 2);
    TINY.assert_undisturbed(coordinator.watch(id));
    assert_eq!(quarantined(&coordinator), []);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_liar_stays_in_quarantine_through_pauses_and_restarts_until_it_is_readmitted() {
    let directory = tempfile::tempdir().unwrap();
    let audits = ["--audit-fraction", "1"];
    let coordinator = CoordinatorProcess::start_in_with(directory.path(), &audits);
    let honest = WorkerProcess::start_many(&coordinator, 2);
    wait_until_joined(&coordinator, "worker-0");
    wait_until_joined(&coordinator, "worker-1");
    spawn_worker(&coordinator, "liar", 1, lies);
    wait_until_joined(&coordinator, "liar");
    let id = SMALL.submit(&coordinator);
    coordinator.process.wait_for("proof", |line| {
        line["message"].as_str().is_some_and(|message| message.starts_with("worker is faulty"))
    });
    assert_eq!(quarantined(&coordinator).len(), 1, "the honest ones are cleared");
    let id_text = id.to_string();
    coordinator.swarmctl(&["pause", &id_text]).expect_success();
    coordinator.swarmctl(&["resume", &id_text]).expect_success();
    drop(honest);
    drop(coordinator);

    let coordinator = CoordinatorProcess::start_in_with(directory.path(), &audits);
    spawn_worker(&coordinator, "liar", 1, lies);
    wait_until_joined(&coordinator, "liar");
    let explanation = coordinator.swarmctl(&["explain", &id_text]).expect_success().json();
    let findings = explanation["findings"].as_array().unwrap();
    let quarantine = findings.iter().find(|finding| finding["kind"] == "quarantine").unwrap();
    let step = quarantine["next_steps"][1].as_str().unwrap();
    let command = "swarmctl workers --readmit liar";
    assert!(step.contains(command), "{step}");
    let _honest = WorkerProcess::start_many(&coordinator, 2);
    SMALL.assert_undisturbed(coordinator.watch(id));

    let workers = coordinator.swarmctl(&["workers", "--readmit", "liar"]).expect_success().json();
    let workers = workers.as_array().unwrap();
    assert!(workers.iter().all(|worker| worker["distrusted"].is_null()), "{workers:?}");
    let again = coordinator.swarmctl(&["workers", "--readmit", "liar"]);
    assert_eq!(again.code, Some(3), "{}", again.stderr);
    assert!(again.stderr.contains("no worker \"liar\" is in quarantine"), "{}", again.stderr);
}

/// An item takes longer than the worker lives.
#[test]
fn a_worker_killed_again_and_again_before_it_finishes_an_item_fails_nothing() {
    let experiment = Experiment::small(1).edit(|value| {
        let algorithm = &mut value["algorithm"];
        algorithm["population_size"] = 4.into();
        algorithm["evaluation_steps"] = 20_000.into();
        algorithm["num_evaluations"] = 1.into();
        algorithm["champion_trials"] = 2.into();
    });
    let expected = undisturbed(&experiment);
    let coordinator = CoordinatorProcess::start();
    let id = coordinator.submit(&experiment.path());
    let is_over = Arc::new(AtomicBool::new(false));
    thread::scope(|scope| {
        let killer = scope.spawn(|| {
            let (mut n_kills, mut n_seen) = (0, 0);
            while !is_over.load(Relaxed) {
                let mut worker = WorkerProcess::start(&coordinator, "mortal");
                n_kills += 1;
                // The time to live begins when the worker can compute.
                let joined = |line: &harness::LogLine| line["message"] == "worker joined";
                n_seen = coordinator.process.find(n_seen, "the worker", joined).0;
                thread::park_timeout(LIFE);
                worker.process.kill();
            }
            n_kills
        });
        let finished = coordinator.watch(id).finish();
        is_over.store(true, Relaxed);
        assert_eq!(finished.digests(), expected);
        assert!(killer.join().unwrap() > 3);
    });
}

/// Shorter than an item.
const LIFE: Duration = Duration::from_millis(100);

#[test]
fn killing_all_workers_at_once_while_several_have_copies_of_an_item_fails_nothing() {
    let coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 6);
    let id = SMALL.submit(&coordinator);
    for round in 0..2 {
        super::wait_for_assignment(&coordinator, 2 * round);
        for frozen in &workers[..2] {
            frozen.process.signal("STOP");
        }
        // The frozen workers keep their generation incomplete. When the others get more items,
        // these are copies of the frozen workers' items.
        let n_seen = coordinator.process.lines().len();
        coordinator.process.find(n_seen, "more work", |line| line["message"] == "items assigned");
        for worker in &mut workers {
            worker.process.kill();
        }
        workers = WorkerProcess::start_many(&coordinator, 6);
    }
    SMALL.assert_undisturbed(coordinator.watch(id));
    assert_eq!(quarantined(&coordinator), []);
}

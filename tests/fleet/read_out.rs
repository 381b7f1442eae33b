//! The data that `swarmctl` reads from a fleet: history, events, ends of experiments, and
//! explanations.

use harness::{CoordinatorProcess, Experiment, WorkerProcess};
use serde_json::Value;
use swarm_proto::v1::{
    ListEventsRequest, ListGenerationsRequest, experiment_service_client::ExperimentServiceClient,
};

fn finding(coordinator: &CoordinatorProcess, id: &str) -> Value {
    let outcome = coordinator.swarmctl(&["explain", id]).expect_success();
    let explanation: Value = serde_json::from_str(&outcome.stdout).unwrap();
    explanation["findings"][0]["kind"].clone()
}

#[test]
fn waiting_is_explained_and_ends_with_the_experiment() {
    let coordinator = CoordinatorProcess::start();
    let completes = coordinator.submit(&Experiment::small(3).path()).to_string();
    let endless = coordinator.submit(&Experiment::small(100_000).path()).to_string();
    assert_eq!(finding(&coordinator, &completes), "no_workers");
    let late = coordinator.swarmctl(&["watch", "--quiet", &completes, "--timeout", "0s"]);
    assert_eq!(late.code, Some(10), "{late:#?}");

    coordinator.swarmctl(&["pause", &endless, "--reason", "lunch"]).expect_success();
    assert_eq!(finding(&coordinator, &endless), "paused");
    let _worker = WorkerProcess::start(&coordinator, "worker-0");
    coordinator.swarmctl(&["watch", "--quiet", &completes]).expect_success();
    assert_eq!(finding(&coordinator, &completes), "ended");
    let workers = coordinator.swarmctl(&["workers"]).expect_success();
    let workers: Value = serde_json::from_str(&workers.stdout).unwrap();
    assert_eq!(workers[0]["name"], "worker-0");

    coordinator.swarmctl(&["resume", &endless]).expect_success();
    coordinator.swarmctl(&["priority", &endless, "200"]).expect_success();
    coordinator.swarmctl(&["cancel", &endless]).expect_success();
    assert_eq!(coordinator.swarmctl(&["watch", "--quiet", &endless]).code, Some(6));
    coordinator.swarmctl(&["watch", "--quiet", &endless, "--for", "ended"]).expect_success();
}

#[tokio::test(flavor = "multi_thread")]
async fn history_and_events_are_all_there_page_by_page() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let ids = [5, 3].map(|generations| coordinator.submit(&Experiment::small(generations).path()));
    let finished = coordinator.watch(ids[0]).finish();
    let digests: Vec<&str> =
        finished.generations.iter().map(|line| line["digest"].as_str().unwrap()).collect();
    coordinator.swarmctl(&["watch", "--quiet", &ids[1].to_string()]).expect_success();

    let csv = coordinator.swarmctl(&["history", &ids[0].to_string(), "-o", "csv"]).expect_success();
    let rows: Vec<&str> = csv.stdout.lines().skip(1).collect();
    let listed: Vec<&str> = rows.iter().map(|row| row.rsplit(',').next().unwrap()).collect();
    assert_eq!(listed, digests);

    let log =
        coordinator.swarmctl(&["watch", "--events", "--so-far"]).expect_success().json_lines();
    let times: Vec<u64> = log.iter().map(|line| line["at_ms"].as_u64().unwrap()).collect();
    assert!(times.is_sorted(), "{times:?}");
    for (id, n_generations) in [(ids[0], 5), (ids[1], 3)] {
        let ours: Vec<&Value> = log.iter().filter(|line| line["experiment"] == id).collect();
        let sequences = ours.iter().map(|line| line["sequence"].as_u64().unwrap());
        assert!(sequences.eq(1..=ours.len() as u64), "each event once, in order");
        let n = ours.iter().filter(|line| line["kind"] == "generation").count();
        assert_eq!(n, n_generations);
        assert_eq!(ours.last().unwrap()["state"], "completed");
    }
    let id = ids[0].to_string();
    let followed = coordinator.swarmctl(&["watch", "--events", &id]).expect_success().json_lines();
    let ours: Vec<Value> = log.into_iter().filter(|line| line["experiment"] == ids[0]).collect();
    assert_eq!(followed, ours, "following ends with the experiment");

    let mut client = ExperimentServiceClient::connect(coordinator.url()).await.unwrap();
    let experiment_id = ids[0];
    let mut seen = Vec::new();
    let mut next = Some(0);
    while let Some(from_generation) = next {
        let request = ListGenerationsRequest { experiment_id, from_generation, page_size: 2 };
        let page = client.list_generations(request).await.unwrap().into_inner();
        assert!(page.generations.len() <= 2);
        seen.extend(page.generations.into_iter().map(|g| g.summary.unwrap().digest));
        next = page.next_generation;
    }
    assert_eq!(seen, digests);
    let request = ListEventsRequest { experiment_id, from_sequence: 2, page_size: 1 };
    let page = client.list_events(request).await.unwrap().into_inner();
    assert_eq!(page.events.len(), 1);
    assert_eq!((page.events[0].sequence, page.next_sequence), (2, Some(3)));
}

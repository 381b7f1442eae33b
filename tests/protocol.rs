//! The wire protocol, spoken by hand.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use harness::{CoordinatorProcess, Experiment};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        Hello, ItemBatch, ItemFailure, ItemResult, ItemResults, SubmitExperimentRequest,
        SubmitExperimentResponse, WorkRequest, WorkResponse,
        experiment_service_client::ExperimentServiceClient, item_result::Outcome, work_request,
        work_response, worker_service_client::WorkerServiceClient,
    },
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming, transport::Channel};

fn hello() -> Hello {
    Hello {
        protocol_version: PROTOCOL_VERSION,
        sim_core_fingerprint: sim_core::FINGERPRINT.to_owned(),
        name: "by hand".to_owned(),
        slots: 1,
    }
}

/// A worker whose every word is chosen by the test.
struct HandWorker {
    outbox: mpsc::Sender<WorkRequest>,
    inbox: Streaming<WorkResponse>,
}

impl HandWorker {
    async fn connect(url: &str, hello: Hello) -> Result<Self, Status> {
        let mut client = WorkerServiceClient::connect(url.to_owned()).await.unwrap();
        let (outbox, requests) = mpsc::channel(16);
        let worker = client.work(ReceiverStream::new(requests));
        let message = Some(work_request::Message::Hello(hello));
        outbox.send(WorkRequest { message }).await.unwrap();
        Ok(Self { outbox, inbox: worker.await?.into_inner() })
    }

    async fn receive(&mut self) -> Result<work_response::Message, Status> {
        Ok(self.inbox.message().await?.expect("the stream goes on").message.expect("known kind"))
    }

    async fn receive_batch(&mut self) -> Result<ItemBatch, Status> {
        loop {
            if let work_response::Message::Batch(batch) = self.receive().await? {
                return Ok(batch);
            }
        }
    }

    async fn answer(&self, item_id: u64, outcome: Outcome) {
        let result = ItemResult { item_id, outcome: Some(outcome), compute_us: 1 };
        let results = ItemResults { results: vec![result] };
        let message = Some(work_request::Message::Results(results));
        self.outbox.send(WorkRequest { message }).await.unwrap();
    }
}

async fn submit(
    url: &str,
    request_id: &str,
    config_json: String,
) -> Result<SubmitExperimentResponse, Status> {
    let mut client: ExperimentServiceClient<Channel> =
        ExperimentServiceClient::connect(url.to_owned()).await.unwrap();
    let request = SubmitExperimentRequest {
        request_id: request_id.to_owned(),
        config_json,
        ..Default::default()
    };
    Ok(client.submit_experiment(request).await?.into_inner())
}

#[tokio::test]
async fn a_worker_of_another_version_is_refused_with_both_versions() {
    let coordinator = CoordinatorProcess::start();
    let other_protocol = Hello { protocol_version: 999, ..hello() };
    let other_simulation = Hello { sim_core_fingerprint: "sim-core 999".to_owned(), ..hello() };
    for (hello, theirs, ours) in [
        (other_protocol, "999", PROTOCOL_VERSION.to_string()),
        (other_simulation, "sim-core 999", sim_core::FINGERPRINT.to_owned()),
    ] {
        let Err(status) = HandWorker::connect(&coordinator.url(), hello).await else {
            panic!("it was let in")
        };
        assert_eq!(status.code(), Code::FailedPrecondition);
        assert!(status.message().contains(theirs) && status.message().contains(&ours), "{status}");
        let reason = status.message().to_owned();
        coordinator.process.wait_for("refusal", |line| {
            line["message"] == "worker refused" && line["reason"] == *reason
        });
    }
}

#[tokio::test]
async fn impossible_introductions_are_refused() {
    let coordinator = CoordinatorProcess::start();
    for hello in [
        Hello { slots: 0, ..hello() },
        Hello { slots: u32::MAX, ..hello() },
        Hello { name: "x".repeat(1000), ..hello() },
    ] {
        let Err(status) = HandWorker::connect(&coordinator.url(), hello).await else {
            panic!("it was let in")
        };
        assert_eq!(status.code(), Code::InvalidArgument);
    }
}

#[tokio::test]
async fn submitting_twice_under_one_request_id_creates_one_experiment() {
    let coordinator = CoordinatorProcess::start();
    let text = Experiment::small(1).text();
    let first = submit(&coordinator.url(), "key", text.clone()).await.unwrap();
    let second = submit(&coordinator.url(), "key", text.clone()).await.unwrap();
    let third = submit(&coordinator.url(), "other key", text).await.unwrap();
    let id = |response: SubmitExperimentResponse| response.experiment.unwrap().id;
    let ids = [id(first), id(second), id(third)];
    assert_eq!(ids, [1, 1, 2]);
}

#[tokio::test]
async fn a_bad_configuration_is_an_invalid_argument_that_lists_every_problem() {
    let coordinator = CoordinatorProcess::start();
    let text = Experiment::small(1)
        .edit(|e| {
            e["algorithm"]["evaluation_steps"] = 0.into();
            e["topology"]["dt"] = (-1).into();
        })
        .text();
    let status = submit(&coordinator.url(), "", text).await.unwrap_err();
    assert_eq!(status.code(), Code::InvalidArgument);
    let lines: Vec<&str> = status.message().lines().collect();
    assert_eq!(lines.len(), 2, "{status}");
    assert!(lines.iter().any(|line| line.contains("algorithm.evaluation_steps")), "{status}");
    assert!(lines.iter().any(|line| line.contains("topology.dt")), "{status}");
}

#[tokio::test]
async fn an_item_that_fails_everywhere_fails_its_experiment_by_name() {
    let coordinator = CoordinatorProcess::start();
    let id = coordinator.submit(&Experiment::small(1).path());
    let mut worker = HandWorker::connect(&coordinator.url(), hello()).await.unwrap();
    loop {
        let batch = tokio::select! {
            batch = worker.receive() => match batch.unwrap() {
                work_response::Message::Batch(batch) => batch,
                work_response::Message::EndExperiment(_) => break,
                _ => continue,
            },
        };
        for item in batch.items {
            let failure = ItemFailure { message: "the wheels\ncame off".to_owned() };
            worker.answer(item.item_id, Outcome::Failure(failure)).await;
        }
    }
    let outcome = coordinator.swarmctl(&["watch", &id.to_string()]);
    assert_eq!(outcome.code, Some(5));
    let last = outcome.json_lines().pop().unwrap();
    assert_eq!(last["state"], "failed");
    let reason = last["reason"].as_str().unwrap();
    assert!(reason.contains("generation 0") && reason.contains("the wheels came off"), "{reason}");
}

#[tokio::test]
async fn a_worker_that_returns_the_wrong_number_of_values_is_dropped() {
    let coordinator = CoordinatorProcess::start();
    coordinator.submit(&Experiment::small(1).path());
    let mut worker = HandWorker::connect(&coordinator.url(), hello()).await.unwrap();
    let batch = worker.receive_batch().await.unwrap();
    let fitness = swarm_proto::v1::TrialFitness { values: vec![1.0; 99] };
    worker.answer(batch.items[0].item_id, Outcome::Fitness(fitness)).await;
    let status = loop {
        match worker.receive().await {
            Ok(_) => {}
            Err(status) => break status,
        }
    };
    assert_eq!(status.code(), Code::Aborted);
    assert!(status.message().contains("99 values"), "{status}");
}

#[tokio::test]
async fn a_silent_worker_loses_its_items_and_its_stream() {
    let coordinator = CoordinatorProcess::start_with(&["--lease", "1"]);
    coordinator.submit(&Experiment::small(1).path());
    let mut worker = HandWorker::connect(&coordinator.url(), hello()).await.unwrap();
    worker.receive_batch().await.unwrap();
    let lost = coordinator.process.wait_for("loss", |line| line["message"] == "worker lost");
    assert_eq!(lost["reason"], "silent for 1 s");
    assert_eq!(lost["items_requeued"], 2);
    assert_eq!(worker.receive().await.unwrap_err().code(), Code::Aborted);
}

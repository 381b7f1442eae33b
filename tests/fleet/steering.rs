//! Experiments are steered while they run: paused, resumed, reprioritised,
//! watched over.

use harness::{CoordinatorProcess, Experiment, WorkerProcess, undisturbed};
use swarm_proto::v1::{
    CancelExperimentRequest, ExperimentState, GetExperimentRequest, ListWorkersRequest,
    PauseExperimentRequest, ResumeExperimentRequest, SetPriorityRequest,
    experiment_service_client::ExperimentServiceClient, fleet_service_client::FleetServiceClient,
};
use tonic::{Code, transport::Channel};

const GENERATIONS: u64 = 4;

async fn experiments(coordinator: &CoordinatorProcess) -> ExperimentServiceClient<Channel> {
    ExperimentServiceClient::connect(coordinator.url()).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pause_outlives_the_coordinator_and_changes_no_bit() {
    let mut coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let experiment = Experiment::small(GENERATIONS);
    let experiment_id = coordinator.submit(&experiment.path());
    let watch = coordinator.watch(experiment_id);
    coordinator.wait_for_generation(0);

    let request = PauseExperimentRequest { experiment_id, reason: "maintenance".to_owned() };
    let paused = experiments(&coordinator).await.pause_experiment(request).await.unwrap();
    let paused = paused.into_inner().experiment.unwrap();
    assert_eq!(paused.state(), ExperimentState::Paused);
    assert_eq!(paused.reason, "paused by a client: maintenance");
    assert!(paused.generations_done < GENERATIONS, "the pause came within the run");

    coordinator.process.kill();
    coordinator.restart();
    let mut client = experiments(&coordinator).await;
    coordinator.process.wait_for("pause", |line| line["message"] == "experiment is paused");
    let get = GetExperimentRequest { experiment_id };
    let found = client.get_experiment(get).await.unwrap().into_inner().experiment.unwrap();
    assert_eq!(found.state(), ExperimentState::Paused);
    let resume = ResumeExperimentRequest { experiment_id };
    let resumed = client.resume_experiment(resume).await.unwrap().into_inner();
    let resumed = resumed.experiment.unwrap();
    assert_eq!((resumed.state(), resumed.reason.as_str()), (ExperimentState::Running, ""));

    assert_eq!(watch.finish().digests(), undisturbed(&experiment));
    for status in [
        client.resume_experiment(resume).await.unwrap_err(),
        client
            .pause_experiment(PauseExperimentRequest { experiment_id, reason: String::new() })
            .await
            .unwrap_err(),
    ] {
        assert_eq!(status.code(), Code::FailedPrecondition, "it has ended: {status}");
    }
}

#[tokio::test]
async fn a_paused_experiment_can_be_given_another_reason_and_priority_and_be_cancelled() {
    let coordinator = CoordinatorProcess::start();
    let experiment_id = coordinator.submit(&Experiment::small(GENERATIONS).path());
    let mut client = experiments(&coordinator).await;
    for (reason, expected) in [
        ("", "paused by a client"),
        ("lunch", "paused by a client: lunch"),
        ("", "paused by a client: lunch"),
        ("dinner", "paused by a client: dinner"),
    ] {
        let pause = PauseExperimentRequest { experiment_id, reason: reason.to_owned() };
        let paused = client.pause_experiment(pause).await.unwrap().into_inner();
        assert_eq!(paused.experiment.unwrap().reason, expected);
    }

    let set = SetPriorityRequest { experiment_id, priority: 300 };
    let changed = client.set_priority(set).await.unwrap().into_inner().experiment.unwrap();
    assert_eq!((changed.priority, changed.state()), (300, ExperimentState::Paused));
    for priority in [0, 1001] {
        let set = SetPriorityRequest { experiment_id, priority };
        let status = client.set_priority(set).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument);
    }

    let cancel = CancelExperimentRequest { experiment_id };
    let cancelled = client.cancel_experiment(cancel).await.unwrap().into_inner();
    assert_eq!(cancelled.experiment.unwrap().state(), ExperimentState::Cancelled);
}

#[tokio::test]
async fn workers_are_listed() {
    let coordinator = CoordinatorProcess::start();
    let mut client = FleetServiceClient::connect(coordinator.url()).await.unwrap();
    let request = ListWorkersRequest {};
    assert!(client.list_workers(request).await.unwrap().into_inner().workers.is_empty());

    let _worker = WorkerProcess::start(&coordinator, "ada");
    coordinator.submit(&Experiment::small(GENERATIONS).path());
    coordinator.wait_for_generation(0);
    let workers = client.list_workers(request).await.unwrap().into_inner().workers;
    let [worker] = &workers[..] else { panic!("one worker, not {workers:?}") };
    assert_eq!((worker.name.as_str(), worker.slots), ("ada", 1));
    assert_eq!(worker.version, env!("CARGO_PKG_VERSION"));
    assert!(worker.connected_at_ms <= worker.last_heard_at_ms);
    assert!(!worker.draining && worker.distrusted.is_empty());
}

//! The wire protocol, message by message.

use std::collections::BTreeSet;

use harness::{CoordinatorProcess, Experiment, HandWorker, WorkerProcess, hello};
use swarm_proto::{
    PROTOCOL_VERSION,
    v1::{
        Hello, SubmitExperimentRequest, SubmitExperimentResponse, WorkRequest, WorkResponse,
        experiment_service_client::ExperimentServiceClient,
        worker_service_server::{WorkerService, WorkerServiceServer},
    },
};
use tokio::net::TcpListener;
use tokio_stream::{Empty, wrappers::TcpListenerStream};
use tonic::{
    Code, Request, Response, Status, Streaming,
    transport::{Channel, Endpoint, Server},
};
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};
use tonic_reflection::pb::{
    v1::{
        ServerReflectionRequest, server_reflection_client::ServerReflectionClient,
        server_reflection_request::MessageRequest, server_reflection_response::MessageResponse,
    },
    v1alpha,
};

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
    let other_protocol = Hello { protocol_version: 999, ..hello() };
    let other_simulation = Hello { sim_core_fingerprint: "sim-core 999".to_owned(), ..hello() };
    for (hello, theirs, ours) in [
        (other_protocol, "999", PROTOCOL_VERSION.to_string()),
        (other_simulation, "sim-core 999", sim_core::FINGERPRINT.to_owned()),
    ] {
        // Each case has its own coordinator, because lines about refusals are throttled.
        let coordinator = CoordinatorProcess::start();
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

/// A coordinator of some other version.
struct OtherVersion;

#[tonic::async_trait]
impl WorkerService for OtherVersion {
    type WorkStream = Empty<Result<WorkResponse, Status>>;

    async fn work(
        &self,
        _: Request<Streaming<WorkRequest>>,
    ) -> Result<Response<Self::WorkStream>, Status> {
        Err(Status::failed_precondition("this is swarmevo 9; run the same release on both sides"))
    }
}

#[tokio::test]
async fn a_worker_that_meets_another_version_ends_and_says_what_to_do() {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let serving = Server::builder()
        .add_service(WorkerServiceServer::new(OtherVersion))
        .serve_with_incoming(TcpListenerStream::new(listener));
    let server = tokio::spawn(serving);
    let mut worker = WorkerProcess::start_with(&url, "w", &[]);
    let (code, last) = tokio::task::spawn_blocking(move || {
        (worker.process.wait().code(), worker.process.lines().pop().unwrap())
    })
    .await
    .unwrap();
    server.abort();
    assert_eq!(code, Some(9), "{last}");
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("swarmevo 9; run the same release"), "{message}");
    assert!(message.contains(sim_core::FINGERPRINT) && message.contains(&url), "{message}");
}

#[tokio::test]
async fn reflection_shows_every_service_and_health_says_serving() {
    let services = [
        "swarm.v1.ExperimentService",
        "swarm.v1.FleetService",
        "swarm.v1.WorkerService",
        "grpc.health.v1.Health",
    ];
    let coordinator = CoordinatorProcess::start();
    let channel = Endpoint::from_shared(coordinator.url()).unwrap().connect().await.unwrap();
    let ask = |question| ServerReflectionRequest {
        message_request: Some(question),
        ..ServerReflectionRequest::default()
    };
    let mut questions = vec![ask(MessageRequest::ListServices(String::new()))];
    questions.extend(services.map(|name| ask(MessageRequest::FileContainingSymbol(name.into()))));
    let mut answers = ServerReflectionClient::new(channel.clone())
        .server_reflection_info(tokio_stream::iter(questions))
        .await
        .unwrap()
        .into_inner();
    let mut next = async || answers.message().await.unwrap().unwrap().message_response.unwrap();
    let MessageResponse::ListServicesResponse(list) = next().await else { panic!("no list") };
    let listed: BTreeSet<String> = list.service.into_iter().map(|service| service.name).collect();
    for service in services {
        assert!(listed.contains(service), "{service} in {listed:?}");
        let MessageResponse::FileDescriptorResponse(files) = next().await else {
            panic!("no description of {service}")
        };
        assert!(!files.file_descriptor_proto.is_empty(), "{service}");
    }
    // Older tools use the older service.
    let question = v1alpha::ServerReflectionRequest {
        message_request: Some(v1alpha::server_reflection_request::MessageRequest::ListServices(
            String::new(),
        )),
        ..Default::default()
    };
    let mut answers =
        v1alpha::server_reflection_client::ServerReflectionClient::new(channel.clone())
            .server_reflection_info(tokio_stream::once(question))
            .await
            .unwrap()
            .into_inner();
    let answer = answers.message().await.unwrap().unwrap();
    assert!(format!("{answer:?}").contains(services[0]), "{answer:?}");

    let mut health = HealthClient::new(channel);
    // The last service is the server as a whole.
    for service in services.iter().take(3).chain(&[""]) {
        let request = HealthCheckRequest { service: (*service).to_owned() };
        let status = health.check(request).await.unwrap().into_inner().status();
        assert_eq!(status, ServingStatus::Serving, "`{service}`");
    }
}

#[tokio::test]
async fn impossible_introductions_are_refused() {
    let coordinator = CoordinatorProcess::start();
    for hello in [
        Hello { slots: 0, ..hello() },
        Hello { slots: u32::MAX, ..hello() },
        Hello { name: "x".repeat(1000), ..hello() },
        Hello { version: "x".repeat(1000), ..hello() },
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
async fn a_silent_worker_loses_its_items_and_its_stream() {
    let coordinator = CoordinatorProcess::start_with(&["--lease", "1"]);
    coordinator.submit(&Experiment::small(1).path());
    let mut worker = HandWorker::connect(&coordinator.url(), hello()).await.unwrap();
    worker.receive_assignments().await.unwrap();
    let lost = coordinator.process.wait_for("loss", |line| line["message"] == "worker lost");
    assert_eq!(lost["reason"], "silent for 1 s");
    assert_eq!(lost["items_requeued"], 2);
    assert_eq!(worker.receive().await.unwrap_err().code(), Code::Aborted);
}

/// Copies experiment 1 of a coordinator to all numbers up to `last`. `state`: of each copy.
fn copy_to(coordinator: &CoordinatorProcess, last: u64, state: impl Fn(u64) -> &'static str) {
    let columns = "id, name, config_digest, fingerprint, genotype_len, state, submitted_at_ms";
    let mut copies = format!("BEGIN; CREATE TEMP TABLE copy AS SELECT {columns} FROM experiments;");
    for id in 2..=last {
        let state = state(id);
        copies += &format!(
            "UPDATE copy SET id = {id}, state = '{state}';
             INSERT INTO experiments ({columns}) SELECT {columns} FROM copy;
             INSERT INTO configs SELECT {id}, config FROM configs WHERE experiment_id = 1;"
        );
    }
    coordinator.database().execute_batch(&(copies + "COMMIT;")).unwrap();
}

#[tokio::test]
async fn there_is_a_limit_to_unfinished_experiments() {
    let coordinator = CoordinatorProcess::start();
    let text = Experiment::small(1).text();
    submit(&coordinator.url(), "", text.clone()).await.unwrap();
    copy_to(&coordinator, 1000, |id| if id % 2 == 0 { "paused" } else { "running" });
    let status = submit(&coordinator.url(), "", text).await.unwrap_err();
    assert_eq!(status.code(), Code::ResourceExhausted);
    assert!(status.message().contains("1000 experiments are unfinished"), "{status}");
}

#[tokio::test]
async fn a_list_of_several_pages_is_whole() {
    let coordinator = CoordinatorProcess::start();
    submit(&coordinator.url(), "", Experiment::small(1).text()).await.unwrap();
    copy_to(&coordinator, 4_000, |_| "cancelled");
    let listed = coordinator.swarmctl(&["list"]).expect_success().json();
    let ids = listed.as_array().unwrap().iter().map(|found| found["id"].as_u64().unwrap());
    assert!(ids.eq(1..=4_000), "each once, in order");
}

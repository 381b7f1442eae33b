//! A coordinator, and clients that submit arbitrary requests.

use std::net::Ipv4Addr;

use coordinator::{Coordinator, labels::LABELS_MAX};
use proptest::{collection::vec, prelude::*, sample::Index, test_runner::TestRunner};
use serde_json::{Value, json};
use swarm_proto::v1::{
    CancelExperimentRequest, ExperimentState, ListExperimentsRequest, SubmitExperimentRequest,
    experiment_service_client::ExperimentServiceClient,
};
use tokio::runtime::Runtime;
use tonic::{Code, Status, transport::Channel};

async fn start() -> (Coordinator, ExperimentServiceClient<Channel>, tempfile::TempDir) {
    let data = tempfile::tempdir().unwrap();
    let config = super::config((Ipv4Addr::LOCALHOST, 0).into(), data.path().to_owned());
    let coordinator = Coordinator::start(config).await.unwrap();
    let url = format!("http://{}", coordinator.local_addr());
    let client = ExperimentServiceClient::connect(url).await.unwrap();
    (coordinator, client, data)
}

/// Values that fit no key; none requires much work.
fn value() -> impl Strategy<Value = Value> {
    let numbers = prop_oneof![
        Just(json!(0)),
        Just(json!(-1)),
        Just(json!(1)),
        Just(json!(0.5)),
        Just(json!(1e308)),
        Just(json!(-5e-324)),
        Just(json!(u64::MAX)),
        Just(json!(i64::MIN)),
    ];
    let others = prop_oneof![
        Just(Value::Null),
        Just(json!(true)),
        Just(json!([])),
        Just(json!({})),
        Just(json!([[[[0]]]])),
        any::<String>().prop_map(Value::from),
    ];
    prop_oneof![numbers, others]
}

/// All values of a document, as JSON pointers.
fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    let escaped = |key: &str| key.replace('~', "~0").replace('/', "~1");
    match value {
        Value::Object(map) => {
            for (key, child) in map {
                pointers(child, &format!("{at}/{}", escaped(key)), found);
            }
        }
        Value::Array(list) => {
            for (i, child) in list.iter().enumerate() {
                pointers(child, &format!("{at}/{i}"), found);
            }
        }
        _ => {}
    }
    found.push(at.to_owned());
}

fn damaged() -> impl Strategy<Value = String> {
    vec((any::<Index>(), value()), 1..4).prop_map(|changes| {
        let mut config: Value =
            serde_json::from_str(include_str!("../../../configs/quickstart.json")).unwrap();
        for (at, value) in changes {
            let mut found = Vec::new();
            pointers(&config, "", &mut found);
            *config.pointer_mut(&found[at.index(found.len())]).unwrap() = value;
        }
        config.to_string()
    })
}

/// Submits a file, and cancels the experiment if it was accepted.
async fn submit(
    mut client: ExperimentServiceClient<Channel>,
    request: SubmitExperimentRequest,
) -> Result<(), Status> {
    let response = client.submit_experiment(request).await?.into_inner();
    let experiment_id = response.experiment.unwrap().id;
    client.cancel_experiment(CancelExperimentRequest { experiment_id }).await.map(|_| ())
}

#[test]
fn every_submission_is_accepted_or_refused_for_a_reason() {
    let runtime = Runtime::new().unwrap();
    let (coordinator, client, _data) = runtime.block_on(start());
    let config = ProptestConfig { cases: 256, failure_persistence: None, ..Default::default() };
    let text = prop_oneof![6 => damaged(), 1 => any::<String>()];
    let overrides = (any::<Option<u64>>(), any::<Option<u64>>(), any::<String>());
    TestRunner::new(config)
        .run(&(text, overrides), |(config_json, (seed, generations, default_name))| {
            let request = SubmitExperimentRequest {
                config_json,
                seed,
                generations,
                default_name,
                ..Default::default()
            };
            if let Err(status) = runtime.block_on(submit(client.clone(), request)) {
                // A panic would be INTERNAL.
                prop_assert_eq!(status.code(), Code::InvalidArgument, "{}", status);
                prop_assert!(!status.message().is_empty());
            }
            Ok(())
        })
        .unwrap();
    runtime.block_on(coordinator.shutdown());
}

#[tokio::test]
async fn a_file_that_is_too_long_is_refused() {
    let (_coordinator, client, _data) = start().await;
    for (n_bytes, expected) in [(2 << 20, Code::InvalidArgument), (9 << 20, Code::OutOfRange)] {
        let config_json = " ".repeat(n_bytes);
        let request = SubmitExperimentRequest { config_json, ..Default::default() };
        assert_eq!(submit(client.clone(), request).await.unwrap_err().code(), expected);
    }
}

#[tokio::test]
async fn a_list_may_repeat_states_without_end_but_wants_few_labels() {
    let (_coordinator, mut client, _data) = start().await;
    let states = vec![ExperimentState::Running.into(); 40_000];
    let request = ListExperimentsRequest { states, ..Default::default() };
    client.list_experiments(request).await.unwrap();
    let states = vec![ExperimentState::Unspecified.into(); 40_000];
    let request = ListExperimentsRequest { states, ..Default::default() };
    let error = client.list_experiments(request).await.unwrap_err();
    assert_eq!(error.code(), Code::InvalidArgument, "{error}");
    let refused = Some(Code::InvalidArgument);
    for (n_labels, expected) in [(LABELS_MAX, None), (LABELS_MAX + 1, refused), (2000, refused)] {
        let labels = (0..n_labels).map(|i| format!("k{i}=v")).collect();
        let request = ListExperimentsRequest { labels, ..Default::default() };
        let answer = client.list_experiments(request).await;
        assert_eq!(answer.err().map(|error| error.code()), expected, "{n_labels}");
    }
}

//! Tests of watchers that do not read, and of lists.

use std::{sync::Arc, time::Duration};

use model::queries::Reader;
use rusqlite::params;
use swarm_proto::v1::{
    ExperimentState, ListExperimentsRequest, SubmitExperimentRequest, WatchExperimentRequest,
    experiment_service_server::ExperimentService as _,
};
use tokio::sync::Semaphore;
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::{Code, Request, Status};

use super::*;
use engine::EngineConfig;

use crate::{
    control::Control,
    driver::{self, Driver, DriverConfig},
    limits::{WATCH_PATIENCE, WATCH_QUEUE_LEN},
    metrics::Instruments,
    referee::{Referee, RefereeProgram},
    shared_store::SharedStore,
    store::Store,
};

const N_NOTICES: u64 = 1000;

/// The service, and an experiment with many events.
async fn service(directory: &tempfile::TempDir) -> Experiments {
    let store = SharedStore::new(Store::open(directory.path()).unwrap());
    let (events, queue) = driver::channel();
    let shutdown = CancellationToken::new();
    let config = DriverConfig {
        engine: EngineConfig::new(Duration::from_secs(10)),
        memory_budget: u64::MAX,
        referee: Referee::new(RefereeProgram::this_program(), Duration::ZERO),
        quarantine: Vec::new(),
        commit_duration: Instruments::default().commit_duration,
    };
    let driver = Driver::new(store.clone(), queue, config, shutdown.clone());
    tokio::spawn(driver.run());
    let service = Experiments {
        reader: Reader::new(store.clone(), 1),
        bundles: Arc::new(Semaphore::new(1)),
        control: Control::new(events, store.clone(), u64::MAX, shutdown.clone()),
        store,
        shutdown,
    };
    let config_json = include_str!("../../../configs/quickstart.json").to_owned();
    let request = SubmitExperimentRequest { config_json, ..Default::default() };
    service.submit_experiment(Request::new(request)).await.unwrap();
    let database = rusqlite::Connection::open(directory.path().join("swarmevo.sqlite3")).unwrap();
    let last: u64 =
        database.query_row("SELECT MAX(sequence) FROM events", [], |row| row.get(0)).unwrap();
    let transaction = database.unchecked_transaction().unwrap();
    for sequence in last + 1..=N_NOTICES {
        let insert = "INSERT INTO events (experiment_id, sequence, at_ms, kind, message) \
                      VALUES (1, ?1, 0, 'notice', 'news')";
        transaction.execute(insert, params![sequence]).unwrap();
    }
    transaction.commit().unwrap();
    service
}

/// Reads sequence numbers up to the last event, or to the status that ends the
/// stream.
async fn read(
    service: &Experiments,
    from_sequence: u64,
    pause: Duration,
) -> (Vec<u64>, Option<Status>) {
    let request = WatchExperimentRequest { experiment_id: 1, from_sequence };
    let mut stream = service.watch_experiment(Request::new(request)).await.unwrap().into_inner();
    tokio::time::sleep(pause).await;
    let mut sequences = Vec::new();
    while sequences.last() != Some(&N_NOTICES) {
        match stream.next().await.expect("the experiment goes on") {
            Ok(response) => sequences.push(response.event.unwrap().sequence),
            Err(status) => return (sequences, Some(status)),
        }
    }
    (sequences, None)
}

#[tokio::test(start_paused = true)]
async fn a_watcher_that_does_not_read_is_told_where_to_resume_and_misses_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let service = service(&directory).await;
    let (mut seen, status) = read(&service, 0, WATCH_PATIENCE * 2).await;
    let status = status.expect("it was dropped");
    assert_eq!(status.code(), Code::Aborted);
    let next = seen.last().unwrap() + 1;
    assert!(status.message().ends_with(&format!("resume from sequence {next}")), "{status}");
    assert_eq!(seen.len(), WATCH_QUEUE_LEN, "no further event waits for it");

    let (rest, status) = read(&service, next, Duration::ZERO).await;
    assert!(status.is_none());
    seen.extend(rest);
    assert_eq!(seen, (1..=N_NOTICES).collect::<Vec<_>>());
}

#[tokio::test(start_paused = true)]
async fn a_watcher_that_pauses_is_not_dropped() {
    let directory = tempfile::tempdir().unwrap();
    let (seen, status) = read(&service(&directory).await, 0, WATCH_PATIENCE / 2).await;
    assert!(status.is_none());
    assert_eq!(seen, (1..=N_NOTICES).collect::<Vec<_>>());
}

#[tokio::test]
async fn a_list_has_the_wanted_experiments_page_by_page() {
    let directory = tempfile::tempdir().unwrap();
    let service = service(&directory).await;
    let request = SubmitExperimentRequest {
        config_json: include_str!("../../../configs/quickstart.json").to_owned(),
        seed: Some(2),
        labels: [("user".to_owned(), "ada".to_owned())].into(),
        ..Default::default()
    };
    service.submit_experiment(Request::new(request)).await.unwrap();
    let list = async |request| {
        let answer = service.list_experiments(Request::new(request)).await?.into_inner();
        Ok::<_, Status>(answer.experiments.iter().map(|found| found.id).collect::<Vec<u64>>())
    };
    let all = ListExperimentsRequest::default;
    assert_eq!(list(all()).await.unwrap(), [1, 2]);
    assert_eq!(list(ListExperimentsRequest { page_size: 1, ..all() }).await.unwrap(), [1]);
    assert_eq!(list(ListExperimentsRequest { after: 1, ..all() }).await.unwrap(), [2]);
    for (label, expected) in [("user", vec![2]), ("user=ada", vec![2]), ("user=eve", vec![])] {
        let labels = vec![label.to_owned()];
        let found = list(ListExperimentsRequest { labels, ..all() }).await.unwrap();
        assert_eq!(found, expected, "{label}");
    }
    for (state, expected) in
        [(ExperimentState::Running, vec![1, 2]), (ExperimentState::Completed, vec![])]
    {
        let states = vec![state.into()];
        let found = list(ListExperimentsRequest { states, ..all() }).await.unwrap();
        assert_eq!(found, expected, "{state:?}");
    }
    for (named, expected) in [("quickstart", vec![1, 2]), ("other", vec![])] {
        let named = named.to_owned();
        assert_eq!(list(ListExperimentsRequest { named, ..all() }).await.unwrap(), expected);
    }
    for unknown in [ExperimentState::Unspecified.into(), 99] {
        let states = vec![ExperimentState::Running.into(), unknown];
        let error = list(ListExperimentsRequest { states, ..all() }).await.unwrap_err();
        assert_eq!(error.code(), Code::InvalidArgument, "{unknown}");
    }
}

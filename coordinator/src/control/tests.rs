//! Clients that do not wait for an answer.

use std::fs;

use tokio::sync::mpsc;

use crate::{ids::WorkerId, store::Store, submission::Submission};

use super::*;

#[tokio::test]
async fn a_stored_experiment_runs_although_its_client_has_gone() {
    let directory = tempfile::tempdir().unwrap();
    let store = SharedStore::new(Store::open(directory.path()).unwrap());
    // The channel to the driver is full.
    let (events, mut queue) = mpsc::channel(1);
    let filler = DriverEvent::WorkerLeft { worker: WorkerId(0), reason: String::new() };
    events.send(filler).await.unwrap();

    let mut news = store.news();
    let control = Control::new(events, store, u64::MAX, CancellationToken::new());
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
    let config_json = fs::read_to_string(path).unwrap();
    let submission = Submission { config_json, ..Submission::default() };
    let client =
        tokio::spawn(async move { control.submit(submission, Existing::default(), None).await });
    news.changed().await.unwrap();
    // The experiment is stored, and the driver does not know it yet.
    client.abort();
    assert!(client.await.unwrap_err().is_cancelled());

    assert!(matches!(queue.recv().await, Some(DriverEvent::WorkerLeft { .. })));
    match queue.recv().await {
        Some(DriverEvent::ExperimentReady(runnable)) => assert_eq!(runnable.id, ExperimentId(1)),
        other => panic!("{other:?}"),
    }
}

//! Clients that call at the same time, or that do not wait for an answer.

use std::{fs, path::Path};

use futures_util::FutureExt as _;
use tokio::sync::mpsc;

use crate::{
    driver::channel, ids::WorkerId, labels::Labels, store::ExperimentState, submission::Submission,
};

use super::*;

const ID: ExperimentId = ExperimentId(1);

fn quickstart() -> Submission {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
    let config_json = fs::read_to_string(path).unwrap();
    Submission { config_json, ..Submission::default() }
}

/// A store with one unfinished experiment, which the driver does not know, and the events for the
/// driver.
fn control(directory: &Path) -> (Control, mpsc::Receiver<DriverEvent>) {
    let mut store = Store::open(directory).unwrap();
    store.create(&quickstart().check(&|| true).unwrap().new, 5).unwrap();
    let (events, queue) = channel();
    let store = SharedStore::new(store);
    (Control::new(events, store, u64::MAX, CancellationToken::new()), queue)
}

/// A driver that answers every request at once. Returns the experiments that it was given to run.
async fn drive(mut queue: mpsc::Receiver<DriverEvent>) -> Vec<ExperimentId> {
    let mut started = Vec::new();
    while let Some(event) = queue.recv().await {
        match event {
            DriverEvent::ExperimentReady(runnable) => started.push(runnable.id),
            DriverEvent::Requested { reply, .. } => reply.send(()).unwrap(),
            other => panic!("{other:?}"),
        }
    }
    started
}

/// Stores that the experiment was cancelled.
async fn cancel(control: &Control) {
    let cancelled = ExperimentState::Cancelled;
    let write = move |store: &mut Store| store.set_state(ID, 6, cancelled, "enough");
    control.store.try_write(write).await.unwrap();
}

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
    let client =
        tokio::spawn(async move { control.submit(quickstart(), Existing::default(), None).await });
    news.changed().await.unwrap();
    // The experiment is stored, and the driver does not know it yet.
    client.abort();
    assert!(client.await.unwrap_err().is_cancelled());

    assert!(matches!(queue.recv().await, Some(DriverEvent::WorkerLeft { .. })));
    match queue.recv().await {
        Some(DriverEvent::ExperimentReady(runnable)) => assert_eq!(runnable.id, ID),
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn an_experiment_that_two_clients_resume_at_the_same_time_starts_once() {
    let directory = tempfile::tempdir().unwrap();
    let (control, queue) = control(directory.path());
    let driver = tokio::spawn(drive(queue));
    cancel(&control).await;
    let (first, second) = tokio::join!(control.resume(ID), control.resume(ID));
    for resumed in [first, second] {
        assert_eq!(resumed.unwrap().state, ExperimentState::Running);
    }
    drop(control);
    assert_eq!(driver.await.unwrap(), [ID]);
}

#[tokio::test]
async fn labels_that_two_clients_set_at_the_same_time_are_both_kept() {
    let directory = tempfile::tempdir().unwrap();
    let (control, _queue) = control(directory.path());
    let labels = |key: &str| Labels::from([(key.to_owned(), String::new())]);
    let (first, second) = tokio::join!(
        control.label(ID, labels("a"), Vec::new()),
        control.label(ID, labels("b"), Vec::new())
    );
    first.unwrap();
    second.unwrap();
    let kept = control.find(ID).await.unwrap().labels;
    assert_eq!(kept.into_keys().collect::<Vec<_>>(), ["a", "b"]);
}

#[tokio::test]
async fn an_experiment_left_alone_starts_once_although_its_first_client_has_gone() {
    let directory = tempfile::tempdir().unwrap();
    let (control, queue) = control(directory.path());
    control.leave_unfinished().await.unwrap();
    assert!(control.take_up_if_left(ID).now_or_never().is_none(), "it goes away meanwhile");
    for _ in 0..2 {
        control.take_up_if_left(ID).await.unwrap();
    }
    drop(control);
    assert_eq!(drive(queue).await, [ID]);
}

#[tokio::test]
async fn an_experiment_left_alone_starts_although_it_could_not_be_read_at_first() {
    let directory = tempfile::tempdir().unwrap();
    let (control, queue) = control(directory.path());
    control.leave_unfinished().await.unwrap();
    let database = rusqlite::Connection::open(directory.path().join("swarmevo.sqlite3")).unwrap();
    database.execute_batch("ALTER TABLE keyframes RENAME TO elsewhere").unwrap();
    control.take_up_if_left(ID).await.unwrap_err();
    database.execute_batch("ALTER TABLE elsewhere RENAME TO keyframes").unwrap();
    control.take_up_if_left(ID).await.unwrap();
    drop(control);
    assert_eq!(drive(queue).await, [ID]);
}

#[tokio::test]
async fn an_experiment_left_alone_that_was_cancelled_does_not_start() {
    let directory = tempfile::tempdir().unwrap();
    let (control, queue) = control(directory.path());
    control.leave_unfinished().await.unwrap();
    cancel(&control).await;
    control.take_up_if_left(ID).await.unwrap();
    drop(control);
    assert!(drive(queue).await.is_empty());
}

#[tokio::test]
async fn an_experiment_left_alone_that_was_reopened_starts_once() {
    let directory = tempfile::tempdir().unwrap();
    let (control, queue) = control(directory.path());
    let driver = tokio::spawn(drive(queue));
    control.leave_unfinished().await.unwrap();
    cancel(&control).await;
    for _ in 0..2 {
        control.resume(ID).await.unwrap();
    }
    drop(control);
    assert_eq!(driver.await.unwrap(), [ID]);
}

//! Writes to a disk that refuses them.

use std::{
    fs,
    sync::atomic::{AtomicU32, Ordering},
};

use crate::{
    store::{Filter, NewExperiment},
    submission::Submission,
};

use super::*;

fn shared() -> (tempfile::TempDir, SharedStore) {
    let directory = tempfile::tempdir().unwrap();
    let store = Store::open(directory.path()).unwrap();
    (directory, SharedStore::new(store))
}

fn new_experiment() -> NewExperiment {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/quickstart.json");
    let config_json = fs::read_to_string(path).unwrap();
    let new = Submission { config_json, ..Submission::default() }.check(&|| true).unwrap().new;
    // More than fits into the reserved space of an empty database.
    NewExperiment { keyframe: vec![0; 1 << 16], ..new }
}

async fn n_experiments(store: &SharedStore) -> usize {
    store.read(|store| store.experiments(&Filter::default())).await.unwrap().len()
}

async fn pragma(store: &SharedStore, name: &'static str, value: u32) {
    store.read(move |store| store.connection().pragma_update(None, name, value)).await.unwrap();
}

/// Asserts that a write waits while the pragma has the bad value, and succeeds by itself with the
/// good one.
async fn assert_waits_out(name: &'static str, bad: u32, good: u32, expected: &str) {
    let (_directory, store) = shared();
    pragma(&store, name, bad).await;
    let failure = store.try_write(|store| store.create(&new_experiment(), 5)).await.unwrap_err();
    assert!(matches!(failure, StoreError::Unavailable(_)), "{failure:?}");
    assert!(failure.to_string().contains(expected), "{failure}");

    let mut news = store.news();
    let writer = store.clone();
    let writing = tokio::spawn(async move {
        let shutdown = CancellationToken::new();
        let new = new_experiment();
        writer
            .write(&shutdown, "it", Retry::WhileUnavailable, move |store| {
                store.create(&new, 5).map(|_| ())
            })
            .await
    });
    news.changed().await.unwrap();
    assert_eq!(n_experiments(&store).await, 0, "an attempt has failed, and left nothing");
    assert!(!writing.is_finished());
    pragma(&store, name, good).await;
    assert!(matches!(writing.await.unwrap(), Written::Yes));
    assert_eq!(n_experiments(&store).await, 1);
}

#[tokio::test]
async fn a_reader_sees_what_another_program_writes_later() {
    let directory = tempfile::tempdir().unwrap();
    drop(Store::open(directory.path()).unwrap());
    let reader = SharedStore::new(Store::open_read_only(directory.path()).unwrap());
    assert_eq!(n_experiments(&reader).await, 0);
    for n_written in 1..4 {
        let mut writer = Store::open(directory.path()).unwrap();
        writer.create(&new_experiment(), 5).unwrap();
        assert_eq!(n_experiments(&reader).await, n_written, "while it has the database");
        drop(writer);
        assert_eq!(n_experiments(&reader).await, n_written, "after it has ended");
    }
}

#[tokio::test]
async fn on_a_full_disk_a_write_waits_for_room() {
    assert_waits_out("max_page_count", 1, 1_000_000, "full").await;
}

#[tokio::test]
async fn on_a_read_only_disk_a_write_waits_until_it_can_be_written() {
    assert_waits_out("query_only", 1, 0, "read").await;
}

#[tokio::test]
async fn a_write_that_waits_for_the_disk_does_not_keep_the_coordinator_from_stopping() {
    let (_directory, store) = shared();
    pragma(&store, "query_only", 1).await;
    let shutdown = CancellationToken::new();
    shutdown.cancel();
    let new = new_experiment();
    let written = store
        .write(&shutdown, "it", Retry::Always, move |store| store.create(&new, 5).map(|_| ()))
        .await;
    assert!(matches!(written, Written::NotWanted));
}

#[tokio::test]
async fn a_write_that_can_never_succeed_is_given_up_unless_the_program_needs_it() {
    let (_directory, store) = shared();
    let shutdown = CancellationToken::new();
    for (retry, n_expected) in [(Retry::WhileUnavailable, 1), (Retry::Always, 2)] {
        let n_attempts = Arc::new(AtomicU32::new(0));
        let counter = Arc::clone(&n_attempts);
        let written = store
            .write(&shutdown, "it", retry, move |_| match counter.fetch_add(1, Ordering::Relaxed) {
                0 => Err(StoreError::Bug(rusqlite::Error::InvalidQuery)),
                _ => Ok(()),
            })
            .await;
        match retry {
            Retry::WhileUnavailable => assert!(matches!(written, Written::Never(_))),
            Retry::Always => assert!(matches!(written, Written::Yes)),
        }
        assert_eq!(n_attempts.load(Ordering::Relaxed), n_expected);
    }
}

#[tokio::test]
async fn a_damaged_database_is_not_written_again_and_the_coordinator_learns_of_it() {
    let (_directory, store) = shared();
    let shutdown = CancellationToken::new();
    for retry in [Retry::WhileUnavailable, Retry::Always] {
        let damaged = |_: &mut Store| Err(StoreError::Corrupt("a page".to_owned()));
        let written = store.write(&shutdown, "it", retry, damaged).await;
        assert!(matches!(written, Written::NotWanted), "no experiment fails because of it");
    }
    match store.unusable().await {
        Unusable::Damaged(why) => assert!(why.contains("a page"), "{why}"),
        other => panic!("{other:?}"),
    }
}

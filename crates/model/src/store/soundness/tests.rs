//! Databases that were edited, copied wrongly or taken over.

use std::{fs, path::Path};

use super::super::{
    Filter,
    older_schemas::tests::downgrade,
    tests::{checkpoint_after, commit, new_experiment},
    *,
};

/// Two experiments after two generations each.
fn two_experiments(directory: &Path) -> (Store, [ExperimentId; 2]) {
    let mut store = Store::open(directory).unwrap();
    let ids = [0, 1].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
    for id in ids {
        commit(&mut store, id, 0, None).unwrap();
        commit(&mut store, id, 1, None).unwrap();
    }
    (store, ids)
}

#[test]
fn edited_and_moved_rows_are_found_and_their_neighbours_are_not_blamed() {
    for (edit, what) in [
        (
            "UPDATE configs SET config = replace(config, '1', '2') WHERE experiment_id = 1",
            "configuration",
        ),
        ("DELETE FROM configs WHERE experiment_id = 1", "configuration"),
        ("UPDATE experiments SET config_digest = 'd' WHERE id = 1", "configuration"),
        ("UPDATE experiments SET fingerprint = 'f' WHERE id = 1", "configuration"),
        ("UPDATE experiments SET seal = x'' WHERE id = 1", "configuration"),
        ("UPDATE keyframes SET state = x'ff' WHERE experiment_id = 1", "checkpoint"),
        ("UPDATE fitness_log SET told = x'ff' WHERE experiment_id = 1", "checkpoint"),
        (
            "UPDATE fitness_log SET generation = 2 WHERE experiment_id = 1 AND generation = 1",
            "checkpoint",
        ),
        ("DELETE FROM fitness_log WHERE experiment_id = 1", "checkpoint"),
        ("DELETE FROM keyframes WHERE experiment_id = 1", "checkpoint"),
        (
            // The row of the other experiment, with its seal.
            "UPDATE keyframes AS k SET (state, seal) =
                    (SELECT state, seal FROM keyframes
                     WHERE experiment_id = 2 AND n_generations = k.n_generations)
             WHERE experiment_id = 1",
            "checkpoint",
        ),
        (
            "UPDATE fitness_log AS l SET (told, seal) =
                    (SELECT told, seal FROM fitness_log
                     WHERE experiment_id = 2 AND generation = l.generation)
             WHERE experiment_id = 1",
            "checkpoint",
        ),
        ("DELETE FROM generations WHERE experiment_id = 1 AND generation = 1", "history"),
        ("UPDATE generations SET digest = 'd' WHERE experiment_id = 1", "history"),
        ("UPDATE experiments SET state = 'odd' WHERE id = 1", "state \"odd\""),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let (store, [edited, neighbour]) = two_experiments(directory.path());
        let sound = store.resumable(edited).unwrap();
        assert_eq!(sound.1, checkpoint_after(1));
        store.connection.pragma_update(None, "ignore_check_constraints", true).unwrap();
        store.connection.execute_batch(edit).unwrap();
        match store.resumable(edited) {
            Err(error @ StoreError::Unsound { .. }) => {
                let text = error.to_string();
                for part in [what, "experiment 1", "swarmctl doctor --data-dir"] {
                    assert!(text.contains(part), "{edit}: {text}");
                }
            }
            other => panic!("{edit}: {other:?}"),
        }
        store.resumable(neighbour).unwrap();
    }
}

#[test]
fn an_earlier_keyframe_or_entry_of_the_same_experiment_is_not_taken_for_another() {
    for (n_committed, put_back) in [
        (
            3,
            "UPDATE keyframes SET (state, seal) =
                    (SELECT state, seal FROM keyframes WHERE experiment_id = 1
                     AND n_generations = 1) WHERE n_generations = 3",
        ),
        (
            4,
            "UPDATE fitness_log SET (told, seal) =
                    (SELECT told, seal FROM fitness_log WHERE experiment_id = 1
                     AND generation = 1) WHERE generation = 3",
        ),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let (mut store, [id, _]) = two_experiments(directory.path());
        for number in 2..n_committed {
            commit(&mut store, id, number, None).unwrap();
        }
        store.resumable(id).unwrap();
        assert_eq!(store.connection.execute(put_back, []).unwrap(), 1);
        assert!(matches!(store.resumable(id), Err(StoreError::Unsound { .. })), "{put_back}");
    }
}

#[test]
fn an_edited_champion_is_damage() {
    for edit in [
        "UPDATE champions SET genotype = '[0.5,0.5]'",
        "UPDATE champions SET held_out_mean = 9",
        "UPDATE champions SET judged_mean = 9, judged_low = 8, judged_high = 10, judged_trials = 2,
                judged_generation = 1",
        "UPDATE experiments SET digest = 'd'",
        "DELETE FROM generations WHERE generation = 1",
    ] {
        let directory = tempfile::tempdir().unwrap();
        let (store, [id, _]) = two_experiments(directory.path());
        store.champion(id).unwrap().unwrap();
        store.connection.execute_batch(edit).unwrap();
        assert!(matches!(store.champion(id), Err(StoreError::Corrupt(_))), "{edit}");
    }
}

#[test]
fn an_experiment_that_is_set_aside_says_why_once_and_loses_nothing() {
    let directory = tempfile::tempdir().unwrap();
    let (mut store, [id, other]) = two_experiments(directory.path());
    store.set_state(other, 6, ExperimentState::Paused, "for lunch").unwrap();
    let n_events = store.events(id, 1, 100).unwrap().len();
    for id in [id, other] {
        store.set_aside(id, 7, "damaged").unwrap();
        store.set_aside(id, 8, "damaged").unwrap();
        let found = store.resumable(id).unwrap().0;
        assert_eq!((found.state, found.reason.as_str()), (ExperimentState::Paused, "damaged"));
    }
    assert_eq!(store.events(id, 1, 100).unwrap().len(), n_events + 2, "a notice and a pause");
}

#[test]
fn a_coordinator_that_has_lost_the_database_writes_nothing_and_still_reads() {
    let directory = tempfile::tempdir().unwrap();
    let (mut store, [id, _]) = two_experiments(directory.path());
    let other = Connection::open(file::path_in(directory.path())).unwrap();
    other.execute("UPDATE identity SET owner = randomblob(16)", []).unwrap();
    let before = store.events(id, 1, 100).unwrap();
    for result in [
        commit(&mut store, id, 2, None),
        store.set_state(id, 9, ExperimentState::Failed, "why"),
        store.notice(id, 9, "look"),
        store.create(&new_experiment(None), 5).map(|_| ()),
    ] {
        assert!(matches!(result, Err(StoreError::TakenOver { .. })), "{result:?}");
    }
    assert_eq!(store.events(id, 1, 100).unwrap(), before);
    assert_eq!(store.experiments(&Filter::default()).unwrap().len(), 2);
}

/// Copies the database of a directory, with or without its log.
fn copy(directory: &Path, with_log: bool) -> tempfile::TempDir {
    let to = tempfile::tempdir().unwrap();
    let (from, into) = (file::path_in(directory), file::path_in(to.path()));
    if with_log {
        fs::copy(write_ahead_log::path(&from), write_ahead_log::path(&into)).unwrap();
    }
    fs::copy(from, into).unwrap();
    to
}

#[test]
fn a_copy_of_a_database_in_use_is_refused_without_its_log() {
    let directory = tempfile::tempdir().unwrap();
    let assert_refused = || {
        let copied = copy(directory.path(), false);
        match Store::open(copied.path()) {
            Err(error @ StoreError::WithoutLog { .. }) => {
                assert!(error.to_string().contains("swarmctl backup"), "{error}");
            }
            other => panic!("{other:?}"),
        }
    };
    let mut store = Store::open(directory.path()).unwrap();
    assert_refused();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    assert_refused();

    // The state that a killed coordinator leaves.
    let killed = copy(directory.path(), true);
    // A program that reads it may move the log into the main file.
    let looked_at = copy(directory.path(), true);
    let looking = Connection::open(file::path_in(looked_at.path())).unwrap();
    looking.query_row("SELECT count(*) FROM experiments", [], |_| Ok(())).unwrap();
    drop(looking);
    assert!(!write_ahead_log::exists(&file::path_in(looked_at.path())));
    drop(store);
    let stopped = copy(directory.path(), false);
    for sound in [killed, looked_at, stopped] {
        Store::open(sound.path()).unwrap().resumable(id).unwrap();
    }
}

#[test]
fn a_long_log_is_moved_into_the_main_file_which_still_needs_it() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    let new = NewExperiment { keyframe: vec![0; 1 << 20], ..new_experiment(None) };
    let database = file::path_in(directory.path());
    let main_len = || fs::metadata(&database).unwrap().len();
    let mut n_folded = 0;
    for _ in 0..40 {
        let before = main_len();
        store.create(&new, 5).unwrap();
        n_folded += u32::from(main_len() > before);
    }
    assert_eq!(n_folded, 10, "four of them make 1000 pages");
    let copied = copy(directory.path(), false);
    assert!(matches!(Store::open(copied.path()), Err(StoreError::WithoutLog { .. })));
    let copied = copy(directory.path(), true);
    assert_eq!(
        Store::open(copied.path()).unwrap().experiments(&Filter::default()).unwrap().len(),
        40
    );
}

#[test]
fn a_database_that_could_not_clear_its_flag_opens_again() {
    for has_room_at_the_end in [true, false] {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let (id, _) = store.create(&new_experiment(None), 5).unwrap();
        // It ends with the connection, as the lack of room ends before the next start.
        let full = "CREATE TEMP TRIGGER no_room BEFORE UPDATE ON main.identity
                    WHEN NOT NEW.needs_log BEGIN SELECT RAISE(ABORT, 'full'); END";
        store.connection.execute_batch(full).unwrap();
        write_ahead_log::fold(&store.connection).unwrap_err();
        if has_room_at_the_end {
            store.connection.execute_batch("DROP TRIGGER no_room").unwrap();
        }
        drop(store);
        let has_log = write_ahead_log::exists(&file::path_in(directory.path()));
        assert_eq!(has_log, !has_room_at_the_end);
        Store::open(directory.path()).unwrap().resumable(id).unwrap();
    }
}

#[test]
fn a_database_of_the_second_schema_is_sealed_as_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let (mut store, [running, ended]) = two_experiments(directory.path());
    commit(&mut store, running, 2, None).unwrap();
    drop(store);
    downgrade(directory.path(), 2);
    let database = Connection::open(file::path_in(directory.path())).unwrap();
    database.execute("UPDATE experiments SET state = 'cancelled' WHERE id = 2", []).unwrap();
    drop(database);
    let store = Store::open(directory.path()).unwrap();
    assert_eq!(store.resumable(running).unwrap().1, checkpoint_after(2));
    store.champion(running).unwrap().unwrap();
    store.champion(ended).unwrap().unwrap();
    let log_of = |id| {
        let found = store.experiment(id).unwrap().unwrap();
        (found.log_from, found.log_gap)
    };
    assert_eq!(log_of(running), (3, LogGap::Older));
    assert_eq!(log_of(ended), (2, LogGap::Older), "its checkpoint was deleted");
}

#[test]
fn invalid_text_and_missing_rows_are_damage_with_the_path() {
    let directory = tempfile::tempdir().unwrap();
    let (mut store, [id, _]) = two_experiments(directory.path());
    let path = file::path_in(directory.path()).display().to_string();
    let assert_damage = |result: Result<()>| match result {
        Err(error @ StoreError::Corrupt(_)) => {
            let text = error.to_string();
            assert!(text.contains(&path) && text.contains("swarmctl doctor"), "{text}");
            assert!(!text.contains("report"), "{text}");
        }
        other => panic!("{other:?}"),
    };
    let garbage = "UPDATE experiments SET name = CAST(x'ff' AS TEXT);
                   UPDATE configs SET config = CAST(x'ff' AS TEXT)";
    store.connection.execute_batch(garbage).unwrap();
    assert_damage(store.experiments(&Filter::default()).map(|_| ()));
    assert_damage(store.experiment(id).map(|_| ()));
    store.connection.execute_batch("DELETE FROM identity").unwrap();
    assert_damage(store.notice(id, 1, "look"));
    drop(store);
    assert_damage(Store::open(directory.path()).map(|_| ()));
}

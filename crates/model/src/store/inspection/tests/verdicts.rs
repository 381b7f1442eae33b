//! All programs agree on the verdict about every kind of damage.

use std::{fs, path::Path};

use evolution::{Champion, ChampionSource, HeldOut, Judged, Real};
use rusqlite::Connection;

use super::{advance, data_directory, edit, findings};
use crate::{
    restored::restore_evolution,
    store::{
        Filter, ForkRecord, NewExperiment, Store, StoreError, file, inspection::*, schema,
        tests::new_experiment,
    },
};

/// The unfinished experiment with generations.
const RUNNING: ExperimentId = ExperimentId(2);

/// Whether a coordinator would continue an experiment.
fn goes_on(store: &Store, id: ExperimentId) -> bool {
    let resumable = store.resumable(id).ok();
    resumable.is_some_and(|(found, checkpoint)| restore_evolution(&found, &checkpoint).is_ok())
}

/// Statements that change, or delete, each value and row of an experiment.
fn edits(directory: &Path) -> Vec<String> {
    let database = Connection::open(file::path_in(directory)).unwrap();
    let mut edits = Vec::new();
    let tables =
        [("experiments", "id"), ("generations", ""), ("fitness_log", ""), ("keyframes", "")];
    for (table, key) in tables.into_iter().chain([("champions", ""), ("events", "")]) {
        let key = if key.is_empty() { "experiment_id" } else { key };
        let mut columns = database
            .prepare(&format!("SELECT name, type FROM pragma_table_info('{table}')"))
            .unwrap();
        let columns = columns.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
        let columns: Vec<(String, String)> = columns.collect::<rusqlite::Result<_>>().unwrap();
        for (column, kind) in columns.into_iter().filter(|(column, _)| column != key) {
            let changes: &[&str] = match &*kind {
                "INTEGER" => &["1000", "-1"],
                "REAL" => &["0.123"],
                "TEXT" => &["'x'", "'[1'"],
                _ => &["x'00'", "x''"],
            };
            for change in changes {
                edits.push(format!("UPDATE {table} SET {column} = {change} WHERE {key} = 2"));
            }
        }
        if table != "experiments" {
            edits.push(format!("DELETE FROM {table} WHERE {key} = 2"));
        }
    }
    edits
}

#[test]
fn doctor_and_coordinator_give_the_same_verdict_of_every_kind_of_damage() {
    let original = data_directory();
    let (mut n_damaged, mut n_harmless) = (0, 0);
    for sql in edits(original.path()) {
        let directory = tempfile::tempdir().unwrap();
        fs::copy(file::path_in(original.path()), file::path_in(directory.path())).unwrap();
        let database = Connection::open(file::path_in(directory.path())).unwrap();
        // The schema excludes this value.
        if database.execute_batch(&sql).is_err() {
            continue;
        }
        drop(database);
        let inspection = inspect(directory.path()).unwrap();
        let is_found =
            inspection.findings.iter().any(|finding| finding.experiment == Some(RUNNING));
        let coordinator = Store::open(directory.path()).map(|store| goes_on(&store, RUNNING));
        let goes_on_here = coordinator.unwrap_or(false);
        assert!(goes_on_here || is_found, "{sql}: only the coordinator says that it is damaged");
        // An experiment that continues may be damaged where no run depends on it, such as in its
        // events.
        if goes_on_here {
            n_harmless += 1
        } else {
            n_damaged += 1
        }
        // Both find a recovered copy sound.
        let recovered = directory.path().join("recovered");
        recover(directory.path(), &recovered).unwrap();
        assert_eq!(findings(&recovered), [], "{sql}");
        let store = Store::open(&recovered).unwrap();
        for experiment in store.experiments(&Filter::default()).unwrap() {
            let error = store.resumable(experiment.id).err();
            let is_sound = match &error {
                None => goes_on(&store, experiment.id),
                Some(error) => matches!(error, StoreError::NoCheckpoint(_)),
            };
            assert!(is_sound, "{sql}: {error:?}");
        }
    }
    assert!(n_damaged > 15 && n_harmless > 5, "{n_damaged} and {n_harmless}");
}

#[test]
fn a_damaged_experiment_does_not_prevent_the_backup_of_others() {
    let directory = data_directory();
    edit(directory.path(), "UPDATE champions SET trial_fitness = '[null]' WHERE experiment_id = 1");
    let to = directory.path().join("copy");
    let Backup::Made(inspection) = backup(directory.path(), &to).unwrap() else {
        panic!("there is no copy")
    };
    let damaged: Vec<_> =
        inspection.findings.iter().filter_map(|finding| finding.experiment).collect();
    assert_eq!(damaged, [ExperimentId(1)]);
    let copy = Store::open(&to).unwrap();
    assert_eq!(copy.experiments(&Filter::default()).unwrap().len(), 4);
    assert!(goes_on(&copy, RUNNING));
    assert!(matches!(copy.champion(ExperimentId(1)), Err(StoreError::Corrupt(_))));
}

#[test]
fn a_champion_whose_interval_older_versions_could_not_compute_is_read() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    let one = Real::new(1.0).unwrap();
    let champion = Champion {
        generation: 0,
        source: ChampionSource::Individual(0),
        genotype: vec![0.5],
        trial_fitness: vec![1.0],
        held_out: Some(HeldOut { mean: one, ci95: one, n_trials: 2, generation: 0 }),
        judged: Some(Judged { mean: one, low: one, high: one, n_trials: 2, generation: 0 }),
    };
    let sealer = crate::store::seals::Sealer::from_database(store.connection()).unwrap();
    for nan in [f64::NAN, -f64::NAN] {
        let transaction = store.connection().unchecked_transaction().unwrap();
        crate::store::champions::put(&transaction, &sealer, id, &champion, None, "").unwrap();
        // Makes the seal as an older version did, which stored NaN as NULL.
        let seal = sealer
            .begin("champion", id)
            .number(0)
            .text(b"")
            .number(0)
            .text(b"[1.0]")
            .text(b"[0.5]")
            .text(b"individual")
            .number(0)
            .text(b"held out")
            .real(1.0)
            .real(nan)
            .number(2)
            .number(0)
            .text(b"judged")
            .real(1.0)
            .real(nan)
            .real(nan)
            .number(2)
            .number(0)
            .finish();
        let sql = "UPDATE champions SET held_out_ci95 = NULL, judged_low = NULL,
                   judged_high = NULL, seal = ?1";
        transaction.execute(sql, [seal]).unwrap();
        transaction.commit().unwrap();
        let found = store.champion(id).unwrap().unwrap();
        assert_eq!(found.held_out.unwrap().ci95, f64::INFINITY);
        let judged = found.judged.unwrap();
        assert_eq!((judged.low.get(), judged.high.get()), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(findings(directory.path()), []);
    }
    edit(directory.path(), "UPDATE champions SET judged_mean = 2");
    assert!(matches!(store.champion(id), Err(StoreError::Corrupt(_))));
}

#[test]
fn a_list_that_could_not_be_read_again_is_not_stored() {
    let directory = data_directory();
    let store = Store::open(directory.path()).unwrap();
    let champion = Champion {
        generation: 0,
        source: ChampionSource::Mean,
        genotype: vec![f64::NAN],
        trial_fitness: Vec::new(),
        held_out: None,
        judged: None,
    };
    let sealer = crate::store::seals::Sealer::from_database(store.connection()).unwrap();
    let transaction = store.connection().unchecked_transaction().unwrap();
    let put = crate::store::champions::put(&transaction, &sealer, RUNNING, &champion, None, "");
    assert!(put.unwrap_err().to_string().contains("not finite"));
}

#[test]
fn tables_of_another_program_are_refused_in_one_short_line() {
    for version in 0..=schema::VERSION {
        for tables in
            ["", "CREATE TABLE experiments (a)", "CREATE TABLE generations (x); CREATE TABLE a (b)"]
        {
            let directory = tempfile::tempdir().unwrap();
            edit(directory.path(), &format!("{tables}; PRAGMA user_version = {version}"));
            for error in [
                Store::open(directory.path()).map(drop).unwrap_err(),
                Store::open_read_only(directory.path())
                    .and_then(|store| store.experiments(&Filter::default()))
                    .map(drop)
                    .unwrap_err(),
            ] {
                let text = error.to_string();
                let is_short = text.lines().count() == 1 && text.len() < 400;
                assert!(is_short && !text.contains("report this"), "{version}, {tables}: {text}");
            }
            // The inspection also ends.
            match inspect(directory.path()) {
                Ok(inspection) => {
                    let is_line = |finding: &Finding| finding.what.lines().count() == 1;
                    assert!(inspection.findings.iter().all(is_line), "{:?}", inspection.findings);
                    assert!(!inspection.findings.is_empty(), "{version}, {tables}");
                }
                Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{error}"),
            }
        }
    }
}

#[test]
fn every_program_finds_a_recovered_ended_experiment_sound() {
    let directory = data_directory();
    edit(
        directory.path(),
        "UPDATE fitness_log SET told = x'00' WHERE experiment_id = 1;
         DELETE FROM keyframes WHERE experiment_id = 1",
    );
    let recovered = directory.path().join("recovered");
    recover(directory.path(), &recovered).unwrap();
    assert_eq!(findings(&recovered), []);
    let store = Store::open(&recovered).unwrap();
    let id = ExperimentId(1);
    assert!(store.champion(id).unwrap().is_some());
    let refused = store.resumable(id).unwrap_err();
    assert!(matches!(refused, StoreError::NoCheckpoint(_)), "{refused}");
    // Both report a later change as damage.
    edit(&recovered, "UPDATE configs SET config = '{}' WHERE experiment_id = 1");
    assert!(!findings(&recovered).is_empty());
}

/// A fork of an experiment after its generation 0, for the store.
fn new_fork(store: &Store, parent: ExperimentId) -> NewExperiment {
    let link = store.generations(parent, 0, 1).unwrap()[0].1.digest.clone();
    let keyframe = store.resumable(parent).unwrap().1.keyframe;
    let fork = ForkRecord { parent, generation: 0, link, changes: Vec::new() };
    NewExperiment { fork: Some(fork), keyframe, ..new_experiment(None) }
}

fn fork_of(store: &mut Store, parent: ExperimentId) -> ExperimentId {
    let new = new_fork(store, parent);
    store.create(&new, 5).unwrap().0
}

#[test]
fn generations_that_forks_need_are_deleted_only_after_the_forks() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    let (parent, _) = store.create(&new_experiment(None), 5).unwrap();
    advance(&mut store, parent, None);
    let child = fork_of(&mut store, parent);
    let grandchild = fork_of(&mut store, child);
    for id in [parent, child, grandchild] {
        let ended = crate::store::ExperimentState::Cancelled;
        store.set_state(id, 9, ended, "enough").unwrap();
    }
    for (id, fork) in [(parent, child), (child, grandchild)] {
        let refused = store.delete(id).unwrap_err().to_string();
        assert!(refused.contains(&format!("swarmctl delete {fork}")), "{refused}");
        assert!(store.experiment(id).unwrap().is_some());
    }
    let refused = store.prune(parent, 1, None, 9).unwrap_err();
    assert!(matches!(refused, StoreError::NeededByForks { .. }), "{refused}");
    for id in [grandchild, child, parent] {
        store.delete(id).unwrap();
    }
    assert_eq!(store.experiments(&Filter::default()).unwrap().len(), 0);
}

#[test]
fn a_fork_of_an_experiment_that_was_deleted_meanwhile_is_refused_and_leaves_nothing_behind() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    let (parent, _) = store.create(&new_experiment(None), 5).unwrap();
    advance(&mut store, parent, Some(""));
    let fork = new_fork(&store, parent);
    store.delete(parent).unwrap();
    let refused = store.create(&fork, 6).unwrap_err();
    assert!(matches!(refused, StoreError::ParentGone(id) if id == parent), "{refused}");
    assert_eq!(store.experiments(&Filter::default()).unwrap().len(), 0);
}

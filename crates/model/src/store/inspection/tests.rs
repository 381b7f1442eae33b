//! Databases with damage of every kind, and the results of inspection and recovery.

mod verdicts;

use std::fs;

use evolution::{Checkpoint, Evolution, Told};
use rusqlite::Connection;
use tempfile::TempDir;

use super::{
    super::{file, older_schemas::tests::downgrade, schema, tests::new_experiment},
    *,
};
use crate::store::{
    Entry, ExperimentState, Filter, GenerationCommit, GenerationRecord, LogGap, Store, StoreError,
};

/// Commits a generation of a real evolution, whose fitness is its index.
pub fn advance(store: &mut Store, id: ExperimentId, completed: Option<&str>) {
    advance_to(false, store, id, completed);
}

/// `is_keyframe`: whether a keyframe is kept.
pub fn advance_to(is_keyframe: bool, store: &mut Store, id: ExperimentId, completed: Option<&str>) {
    let (_, checkpoint) = store.resumable(id).unwrap();
    let mut evolution = Evolution::restore(&checkpoint).unwrap();
    let generation = evolution.ask();
    let fitness = vec![vec![generation.index as f64]; generation.genotypes.len()];
    let summary = evolution.tell(generation, &fitness).unwrap();
    let record = GenerationRecord {
        generation: summary.generation,
        statistics: summary.statistics,
        digest: summary.digest.to_string(),
        duration_ms: 5,
        episodes: 300,
        workers: 2,
        idle_share: 0.25,
    };
    let keyframe = is_keyframe.then(|| evolution.keyframe());
    let commit = GenerationCommit {
        generation: &record,
        entry: Entry {
            told: &Told::from_fitness(fitness).to_bytes(),
            keyframe: keyframe.as_deref(),
        },
        champion: evolution.champion(),
        digest: &record.digest,
        notices: &[],
        completed,
    };
    store.commit_generation(id, 1000, &commit).unwrap();
}

/// Experiment 1 completed, 2 running, 3 cancelled, 4 new.
fn store_in(directory: &Path) -> Store {
    let mut store = Store::open(directory).unwrap();
    let ids = [0; 4].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
    for id in &ids[..3] {
        advance(&mut store, *id, None);
        advance(&mut store, *id, None);
    }
    advance(&mut store, ids[0], Some(""));
    store.set_state(ids[2], 9, ExperimentState::Cancelled, "enough").unwrap();
    store
}

pub fn data_directory() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    drop(store_in(directory.path()));
    directory
}

pub fn edit(directory: &Path, sql: &str) {
    let database = Connection::open(file::path_in(directory)).unwrap();
    database.execute_batch(sql).unwrap();
}

pub fn findings(directory: &Path) -> Vec<(Option<u64>, String)> {
    let findings = inspect(directory).unwrap().findings;
    findings.into_iter().map(|f| (f.experiment.map(|id| id.0), f.what)).collect()
}

/// All data of the experiments in a directory, bit for bit.
fn contents(store: &Store) -> Vec<String> {
    let experiments = store.experiments(&Filter::default()).unwrap();
    let all = experiments.iter().map(|experiment| {
        let id = experiment.id;
        let generations = store.generations(id, 0, 100).unwrap();
        let events = store.events(id, 0, 100).unwrap();
        let checkpoint = store.resumable(id).ok().map(|(_, checkpoint)| checkpoint);
        format!("{experiment:?} {generations:?} {events:?} {:?} {checkpoint:?}", store.champion(id))
    });
    all.collect()
}

fn fates(recovery: &Recovery) -> Vec<Fate> {
    recovery.experiments.iter().map(|recovered| recovered.fate).collect()
}

#[test]
fn a_sound_database_has_no_findings_in_use_or_not_and_nothing_is_left_beside_it() {
    let directory = tempfile::tempdir().unwrap();
    let store = store_in(directory.path());
    for _ in 0..2 {
        let inspection = inspect(directory.path()).unwrap();
        assert!(inspection.findings.is_empty(), "{:?}", inspection.findings);
        assert_eq!((inspection.n_experiments, inspection.n_generations), (4, 7));
    }
    drop(store);
    let names = || {
        let entries = fs::read_dir(directory.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    assert!(inspect(directory.path()).unwrap().findings.is_empty());
    assert_eq!(names(), before);
}

#[test]
fn every_edit_is_found_and_named() {
    for (sql, experiment, what) in [
        ("UPDATE configs SET config = '{}' WHERE experiment_id = 2", 2, "its configuration is not"),
        ("DELETE FROM configs WHERE experiment_id = 2", 2, "its configuration cannot be read"),
        (
            "UPDATE generations SET best = 9 WHERE experiment_id = 3",
            3,
            "generation 0 of its history",
        ),
        (
            "DELETE FROM generations WHERE experiment_id = 3 AND generation = 0",
            3,
            "generation 0 is gone",
        ),
        (
            "DELETE FROM generations WHERE experiment_id = 3 AND generation = 1",
            3,
            "or the end of the history, is not",
        ),
        ("UPDATE champions SET genotype = '[]' WHERE experiment_id = 1", 1, "its champion"),
        ("DELETE FROM champions WHERE experiment_id = 1", 1, "its champion is gone"),
        ("UPDATE keyframes SET state = x'' WHERE experiment_id = 2", 2, "its keyframes"),
        ("UPDATE fitness_log SET told = x'' WHERE experiment_id = 2", 2, "its keyframes"),
        (
            "DELETE FROM fitness_log WHERE experiment_id = 2 AND generation = 1",
            2,
            "its fitness log and its history",
        ),
        ("DELETE FROM fitness_log WHERE experiment_id = 1 AND generation = 0", 1, "its keyframes"),
        ("DELETE FROM keyframes WHERE experiment_id = 2", 2, "its keyframes"),
        ("DELETE FROM events WHERE experiment_id = 2 AND sequence = 2", 2, "its events"),
    ] {
        let directory = data_directory();
        edit(directory.path(), sql);
        let findings = findings(directory.path());
        assert!(!findings.is_empty(), "{sql}");
        assert!(findings.iter().all(|found| found.0 == Some(experiment)), "{sql}: {findings:?}");
        assert!(findings.iter().any(|found| found.1.contains(what)), "{sql}: {findings:?}");
    }
}

#[test]
fn rows_without_an_experiment_are_found() {
    let directory = data_directory();
    edit(directory.path(), "PRAGMA foreign_keys = 0; DELETE FROM experiments WHERE id = 3");
    let findings = findings(directory.path());
    assert!(findings.iter().any(|found| found.1.contains("belong to no experiment")));
}

#[test]
fn a_copy_without_its_log_is_found_and_its_content_can_be_kept() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = store_in(directory.path());
    drop(store);
    store = Store::open(directory.path()).unwrap();
    advance(&mut store, ExperimentId(2), None);
    let copied = tempfile::tempdir().unwrap();
    fs::copy(file::path_in(directory.path()), file::path_in(copied.path())).unwrap();
    let found = findings(copied.path());
    assert!(found[0].1.contains("without its write-ahead log"), "{found:?}");
    let to = copied.path().join("new");
    assert_eq!(fates(&recover(copied.path(), &to).unwrap()), [Fate::Kept; 4]);
    let recovered = Store::open(&to).unwrap();
    let latest = recovered.experiment(ExperimentId(2)).unwrap().unwrap().record.latest.unwrap();
    assert_eq!(latest.generation, 1, "the third one was in the log");
}

#[test]
fn recovery_of_a_sound_database_is_a_copy() {
    let directory = data_directory();
    let to = directory.path().join("new");
    assert_eq!(fates(&recover(directory.path(), &to).unwrap()), [Fate::Kept; 4]);
    let [before, after] = [directory.path(), &to].map(|directory| Store::open(directory).unwrap());
    assert_eq!(contents(&before), contents(&after));
    assert!(inspect(&to).unwrap().findings.is_empty());
}

#[test]
fn recovery_keeps_sound_experiments_and_restarts_computable_ones() {
    let directory = data_directory();
    edit(
        directory.path(),
        "UPDATE generations SET best = 9 WHERE experiment_id = 1;
         UPDATE keyframes SET state = x'7b7d' WHERE experiment_id = 2;
         UPDATE configs SET config = '{}' WHERE experiment_id = 3;
         DELETE FROM events WHERE experiment_id = 4;
         INSERT INTO quarantine VALUES ('lab-2', 'it lies', 7);",
    );
    let to = directory.path().join("new");
    let recovery = recover(directory.path(), &to).unwrap();
    assert_eq!(fates(&recovery), [Fate::Restarted, Fate::Restarted, Fate::Lost, Fate::Kept]);
    let mut store = Store::open(&to).unwrap();
    assert_eq!(store.quarantined().unwrap()[0].name, "lab-2");
    for id in [1, 2].map(ExperimentId) {
        let (experiment, checkpoint) = store.resumable(id).unwrap();
        assert_eq!(experiment.state, ExperimentState::Paused);
        assert!(experiment.reason.contains("resume it"), "{}", experiment.reason);
        assert!(experiment.latest.is_none());
        assert_eq!(checkpoint.keyframe, new_experiment(None).keyframe);
        advance(&mut store, id, None);
    }
    assert_eq!(store.experiment(ExperimentId(4)).unwrap().unwrap().state, ExperimentState::Running);
    assert_eq!(store.events(ExperimentId(4), 0, 9).unwrap().len(), 1);
    assert!(store.experiment(ExperimentId(3)).unwrap().is_none());
    let (next, _) = store.create(&new_experiment(None), 5).unwrap();
    assert_eq!(next, ExperimentId(5), "ids are not used again");
    drop(store);
    assert!(inspect(&to).unwrap().findings.is_empty());
}

#[test]
fn the_sound_part_of_a_damaged_log_is_kept() {
    let directory = data_directory();
    let [running, ended] = [2, 1].map(ExperimentId);
    let mut store = Store::open(directory.path()).unwrap();
    advance_to(true, &mut store, running, None);
    advance(&mut store, running, None);
    let before = store.resumable(running).unwrap().1;
    drop(store);
    edit(directory.path(), "UPDATE fitness_log SET told = x'' WHERE generation = 1");
    let what = "the fitness of generations 0 to 2, or the keyframe before them";
    let found = findings(directory.path());
    assert!(found.iter().any(|(id, found)| *id == Some(2) && found.contains(what)), "{found:?}");
    let to = directory.path().join("new");
    let recovery = recover(directory.path(), &to).unwrap();
    assert_eq!(fates(&recovery), [Fate::Kept, Fate::Kept, Fate::Kept, Fate::Kept]);
    assert!(inspect(&to).unwrap().findings.is_empty());
    let store = Store::open(&to).unwrap();
    let log_of = |id| {
        let found = store.experiment(id).unwrap().unwrap();
        (found.log_from, found.log_gap)
    };
    assert_eq!(log_of(running), (3, LogGap::Damaged));
    // Only the lost part of the log shows how many generations had equal fitness.
    assert_eq!(store.resumable(running).unwrap().1, Checkpoint { n_flat: 0, ..before });
    assert_eq!(log_of(ended), (3, LogGap::Damaged), "its results are not damaged");
}

/// With any damaged page, all data in the new directory is unchanged.
#[test]
fn no_damaged_page_gets_into_a_recovered_directory() {
    let sound = data_directory();
    let before = contents(&Store::open(sound.path()).unwrap());
    let bytes = fs::read(file::path_in(sound.path())).unwrap();
    let page_len = 4096;
    let n_pages = bytes.len() / page_len;
    assert!(n_pages > 12, "{n_pages}");
    let n_free: usize = Connection::open(file::path_in(sound.path()))
        .unwrap()
        .query_row("PRAGMA freelist_count", [], |row| row.get(0))
        .unwrap();
    let (mut n_kept, mut n_lost, mut n_harmless) = (0, 0, 0);
    for page in 1..n_pages {
        let directory = tempfile::tempdir().unwrap();
        let mut damaged = bytes.clone();
        let garbage = (0..page_len).map(|i| (i * 31 + page * 7) as u8);
        damaged[page * page_len..][..page_len].copy_from_slice(&garbage.collect::<Vec<_>>());
        fs::write(file::path_in(directory.path()), damaged).unwrap();
        n_harmless += usize::from(findings(directory.path()).is_empty());
        let to = directory.path().join("new");
        let Ok(recovery) = recover(directory.path(), &to) else { continue };
        let store = Store::open(&to).unwrap();
        let after = contents(&store);
        for (recovered, after) in
            recovery.experiments.iter().filter(|r| r.fate != Fate::Lost).zip(&after)
        {
            if recovered.fate == Fate::Kept && recovered.problems.is_empty() {
                n_kept += 1;
                assert_eq!(*after, before[recovered.id.0 as usize - 1], "page {page}");
            } else {
                n_lost += 1;
            }
        }
        drop(store);
        assert!(inspect(&to).unwrap().findings.is_empty(), "page {page}");
    }
    assert!(n_kept > 10 && n_lost > 0, "{n_kept} {n_lost}");
    assert!(
        n_harmless <= n_free,
        "damage is harmless on empty pages only: {n_harmless} of {n_free}"
    );
}

#[test]
fn a_truncated_database_is_read_as_far_as_it_goes() {
    let sound = data_directory();
    let bytes = fs::read(file::path_in(sound.path())).unwrap();
    let mut n_left = Vec::new();
    for len in [bytes.len() - 4096, bytes.len() / 2 + 77, 3 * 4096, 50, 0] {
        let directory = tempfile::tempdir().unwrap();
        fs::write(file::path_in(directory.path()), &bytes[..len]).unwrap();
        assert!(!findings(directory.path()).is_empty(), "{len}");
        let to = directory.path().join("new");
        let is_kept = |fate: &Fate| *fate != Fate::Lost;
        n_left.push(match recover(directory.path(), &to) {
            Ok(recovery) => fates(&recovery).into_iter().filter(is_kept).count(),
            Err(error) => {
                assert!(matches!(error, StoreError::NothingSound { .. }), "{error}");
                assert!(!to.exists());
                0
            }
        });
    }
    assert!(n_left[0] > 0 && n_left[4] == 0, "{n_left:?}");
}

#[test]
fn databases_of_older_schemas_are_inspected_and_recovered_unchanged() {
    let directory = data_directory();
    let mut store = Store::open(directory.path()).unwrap();
    advance_to(true, &mut store, ExperimentId(2), None);
    drop(store);
    downgrade(directory.path(), 2);
    edit(directory.path(), "DELETE FROM checkpoints WHERE experiment_id IN (1, 3)");
    let path = file::path_in(directory.path());
    let before = fs::read(&path).unwrap();
    let inspection = inspect(directory.path()).unwrap();
    assert!(inspection.findings.is_empty(), "{:?}", inspection.findings);
    assert_eq!((inspection.schema_version, inspection.n_generations), (2, 8));
    let to = directory.path().join("new");
    assert_eq!(fates(&recover(directory.path(), &to).unwrap()), [Fate::Kept; 4]);
    assert!(fs::read(&path).unwrap() == before);
    edit(directory.path(), "UPDATE checkpoints SET state = substr(state, 2)");
    edit(
        directory.path(),
        "UPDATE experiments SET config = replace(config, '\"seed\":1', '\"seed\":2')",
    );
    assert!(!findings(directory.path()).is_empty());
}

#[test]
fn backups_are_whole_and_of_one_moment() {
    let directory = tempfile::tempdir().unwrap();
    let mut store = store_in(directory.path());
    let to = directory.path().join("backups").join("today");
    let Backup::Made(inspection) = backup(directory.path(), &to).unwrap() else { panic!() };
    assert_eq!((inspection.path, inspection.n_generations), (file::path_in(&to), 7));
    let then = contents(&store);
    advance(&mut store, ExperimentId(2), None);
    assert_eq!(contents(&Store::open(&to).unwrap()), then);
    assert_ne!(contents(&store), then);
    assert!(matches!(backup(directory.path(), &to), Err(StoreError::NotEmpty { .. })));

    drop(store);
    let stopped = directory.path().join("stopped");
    assert!(matches!(backup(directory.path(), &stopped), Ok(Backup::Made(_))));
    assert_eq!(contents(&Store::open(&stopped).unwrap()).len(), 4);
}

#[test]
fn an_interrupted_backup_is_made_again() {
    let directory = data_directory();
    let to = directory.path().join("backup");
    fs::create_dir(&to).unwrap();
    fs::write(file::unfinished_in(&to), "half a datab").unwrap();
    assert!(matches!(backup(directory.path(), &to), Ok(Backup::Made(_))));
    assert_eq!(fs::read_dir(&to).unwrap().count(), 1);
}

#[test]
fn there_is_no_backup_of_a_damaged_database() {
    let directory = data_directory();
    edit(directory.path(), "PRAGMA foreign_keys = off; DELETE FROM experiments WHERE id = 3");
    let to = directory.path().join("backup");
    let Backup::Damaged(inspection) = backup(directory.path(), &to).unwrap() else { panic!() };
    assert!(inspection.findings.iter().any(|finding| finding.experiment.is_none()));
    assert!(!to.exists());
    let nothing = directory.path().join("nothing");
    assert!(matches!(backup(&nothing, &to), Err(StoreError::NoDatabase { .. })));
    assert!(matches!(inspect(&nothing), Err(StoreError::NoDatabase { .. })));
    edit(directory.path(), &format!("PRAGMA user_version = {}", schema::VERSION + 1));
    assert!(matches!(inspect(directory.path()), Err(StoreError::Newer { .. })));
}

//! The promises of the store.

use std::fs;

use crate::{group::Membership, submission::Submission};
use evolution::{
    Champion, ChampionSource, Checkpoint, Evolution, HeldOut, Judged, Real, Statistics,
};

use super::*;

pub fn new_experiment(request_id: Option<&str>) -> NewExperiment {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/quickstart.json");
    let submission = Submission {
        request_id: request_id.map(str::to_owned),
        config_json: fs::read_to_string(path).unwrap(),
        // Beyond the range of SQLite's integers.
        seed: Some(u64::MAX),
        ..Submission::default()
    };
    submission.check(&|| true).unwrap().new
}

fn real(value: f64) -> Real {
    Real::new(value).unwrap()
}

fn generation(generation: u64) -> GenerationRecord {
    GenerationRecord {
        generation,
        statistics: Statistics {
            best: real(0.1 + 0.2),
            mean: real(1.0 / 3.0),
            min: real(-f64::MIN_POSITIVE),
            standard_deviation: real(f64::INFINITY),
        },
        digest: format!("{generation:064x}"),
        duration_ms: 12,
        episodes: 300,
        workers: 2,
        idle_share: 0.25,
    }
}

/// There is a keyframe after every second generation, from the first on.
pub fn checkpoint_after(number: u64) -> Checkpoint {
    let keyframe = format!("after {}", number / 2 * 2).into();
    let log = (number % 2 == 1).then(|| format!("told {number}").into());
    Checkpoint { keyframe, log: log.into_iter().collect(), n_flat: 0 }
}

pub fn commit(
    store: &mut Store,
    id: ExperimentId,
    number: u64,
    completed: Option<&str>,
) -> Result<()> {
    let champion = Champion {
        generation: number,
        source: ChampionSource::Individual(3),
        genotype: vec![0.1, 1.0 / 3.0],
        trial_fitness: vec![0.5, 0.75],
        held_out: None,
        judged: None,
    };
    let (told, keyframe) = (format!("told {number}"), format!("after {number}"));
    let keyframe = number.is_multiple_of(2).then_some(keyframe.as_bytes());
    store.commit_generation(
        id,
        1000 + number,
        &GenerationCommit {
            generation: &generation(number),
            entry: Entry { told: told.as_bytes(), keyframe },
            champion: Some(&champion),
            digest: "link",
            notices: &["look".to_owned()],
            completed,
        },
    )
}

fn open() -> (tempfile::TempDir, Store) {
    let directory = tempfile::tempdir().unwrap();
    let store = Store::open(directory.path()).unwrap();
    (directory, store)
}

#[test]
fn commits_are_there_after_reopening_bit_for_bit() {
    let (directory, mut store) = open();
    let new = new_experiment(None);
    let (id, _) = store.create(&new, 5).unwrap();
    commit(&mut store, id, 0, None).unwrap();
    commit(&mut store, id, 1, None).unwrap();
    drop(store);

    let store = Store::open(directory.path()).unwrap();
    let experiment = store.experiment(id).unwrap().unwrap();
    assert_eq!(experiment.config_json, new.config.to_canonical_json());
    assert!(experiment.config_json.contains(&u64::MAX.to_string()), "the seed keeps its value");
    assert_eq!(experiment.state, ExperimentState::Running);
    assert_eq!(experiment.latest, Some(generation(1)));
    assert_eq!(experiment.recent_generation_ms, Some(12.0));
    assert_eq!((experiment.held_out_fitness, experiment.judged_fitness), (None, None));
    assert_eq!(experiment.digest, "link");
    assert_eq!(store.resumable(id).unwrap().1, checkpoint_after(1));
    let champion = store.champion(id).unwrap().unwrap();
    assert_eq!(champion.genotype, [0.1, 1.0 / 3.0]);
    assert_eq!(champion.generation, 1);
}

#[test]
fn a_champion_keeps_its_origin_and_both_kinds_of_fitness() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    let held_out =
        HeldOut { mean: real(0.1 + 0.2), ci95: real(1.0 / 3.0), n_trials: 50, generation: 4 };
    let champion = Champion {
        generation: 3,
        source: ChampionSource::Mean,
        genotype: vec![1.0 / 3.0],
        trial_fitness: Vec::new(),
        held_out: Some(held_out),
        judged: None,
    };
    let [mean, low, high] = [0.1, 0.1 / 3.0, 0.7].map(real);
    let judged = Judged { mean, low, high, n_trials: 200, generation: 5 };
    // The end of a run, and then more generations, which change the champion.
    for (number, judged) in [(4, None), (5, Some(judged)), (6, None)] {
        let champion = Champion { judged, ..champion.clone() };
        store
            .commit_generation(
                id,
                1,
                &GenerationCommit {
                    generation: &generation(number),
                    entry: Entry { told: b"told", keyframe: None },
                    champion: Some(&champion),
                    digest: "link",
                    notices: &[],
                    completed: None,
                },
            )
            .unwrap();
        assert_eq!(store.champion(id).unwrap(), Some(champion));
        let experiment = store.experiment(id).unwrap().unwrap();
        assert_eq!(experiment.held_out_fitness, Some(held_out.mean.get()));
        assert_eq!(experiment.judged_fitness, judged.map(|judged| judged.mean.get()));
    }
}

#[test]
fn a_new_experiment_can_be_resumed_before_its_first_generation() {
    let (_directory, mut store) = open();
    let new = new_experiment(None);
    let (id, _) = store.create(&new, 5).unwrap();
    let checkpoint = store.resumable(id).unwrap().1;
    assert_eq!(checkpoint.keyframe, new.keyframe);
    let evolution = Evolution::restore(&checkpoint).unwrap();
    assert_eq!(evolution.n_generations(), 0);
    assert_eq!(evolution.keyframe(), new.keyframe);
    assert_eq!(store.champion(id).unwrap(), None);
}

#[test]
fn a_request_id_creates_one_experiment() {
    let (_directory, mut store) = open();
    let (first, is_new) = store.create(&new_experiment(Some("key")), 5).unwrap();
    assert!(is_new);
    assert_eq!(store.create(&new_experiment(Some("key")), 6).unwrap(), (first, false));
    let (other, is_new) = store.create(&new_experiment(None), 7).unwrap();
    assert!(is_new && other != first);
    assert_eq!(store.experiments(&Filter::default()).unwrap().len(), 2);
}

#[test]
fn events_are_complete_ordered_and_readable_from_any_number() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    commit(&mut store, id, 0, None).unwrap();
    commit(&mut store, id, 1, Some("")).unwrap();
    let events = store.events(id, 1, 100).unwrap();
    let running =
        EventKind::State { state: ExperimentState::Running, reason: "submitted".to_owned() };
    let completed = EventKind::State { state: ExperimentState::Completed, reason: String::new() };
    let notice = EventKind::Notice("look".to_owned());
    let expected = [
        running,
        notice.clone(),
        EventKind::Generation(generation(0)),
        notice,
        EventKind::Generation(generation(1)),
        completed,
    ];
    let kinds: Vec<EventKind> = events.iter().map(|event| event.kind.clone()).collect();
    assert_eq!(kinds, expected);
    let sequences: Vec<u64> = events.iter().map(|event| event.sequence).collect();
    assert_eq!(sequences, [1, 2, 3, 4, 5, 6]);

    assert_eq!(store.events(id, 3, 2).unwrap(), events[2..4]);
    assert_eq!(store.events(id, 7, 100).unwrap(), []);
    assert_eq!(store.events(id, u64::MAX, 100).unwrap(), []);
}

#[test]
fn an_experiment_keeps_its_group_also_when_the_database_is_recovered() {
    let (directory, mut store) = open();
    let membership = Membership::new("sizes", "algorithm.population_size=50").ok();
    let new = NewExperiment { membership: membership.clone(), ..new_experiment(None) };
    let (id, _) = store.create(&new, 5).unwrap();
    let (of_none, _) = store.create(&new_experiment(None), 6).unwrap();
    drop(store);
    let to = directory.path().join("recovered");
    recover(directory.path(), &to).unwrap();
    for directory in [directory.path(), &to] {
        let store = Store::open(directory).unwrap();
        assert_eq!(store.experiment(id).unwrap().unwrap().membership, membership);
        assert_eq!(store.experiment(of_none).unwrap().unwrap().membership, None);
    }
}

#[test]
fn history_is_read_in_parts_and_says_when_generations_were_completed() {
    let (_directory, mut store) = open();
    let ids = [0, 1].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
    assert_eq!(store.generations(ids[0], 0, 100).unwrap(), []);
    for number in 0..4 {
        commit(&mut store, ids[0], number, None).unwrap();
    }
    commit(&mut store, ids[1], 0, None).unwrap();
    let completed = |numbers: std::ops::Range<u64>| -> Vec<_> {
        numbers.map(|number| (1000 + number, generation(number))).collect()
    };
    assert_eq!(store.generations(ids[0], 0, 100).unwrap(), completed(0..4));
    assert_eq!(store.generations(ids[0], 1, 2).unwrap(), completed(1..3));
    assert_eq!(store.generations(ids[0], 4, 100).unwrap(), []);
    assert_eq!(store.generations(ids[0], u64::MAX, 100).unwrap(), []);
    let last_sequence = store.events(ids[0], 1, 100).unwrap().last().unwrap().sequence;
    assert_eq!(store.experiment(ids[0]).unwrap().unwrap().last_sequence, last_sequence);
}

#[test]
fn an_ended_experiment_takes_no_more_generations_and_ends_once() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    store.set_state(id, 6, ExperimentState::Cancelled, "enough").unwrap();
    store.set_state(id, 7, ExperimentState::Failed, "too late").unwrap();
    assert!(
        matches!(commit(&mut store, id, 0, None), Err(StoreError::Ended(ended)) if ended == id)
    );
    let experiment = store.experiment(id).unwrap().unwrap();
    assert_eq!(experiment.state, ExperimentState::Cancelled);
    assert_eq!(experiment.reason, "enough");
    assert_eq!(store.events(id, 1, 100).unwrap().len(), 2);
}

#[test]
fn an_experiment_is_reopened_only_from_the_given_state() {
    let (_directory, mut store) = open();
    let ids = [0, 1].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
    let [completed, cancelled] = ids;
    commit(&mut store, completed, 0, Some("")).unwrap();
    store.set_state(cancelled, 6, ExperimentState::Cancelled, "enough").unwrap();
    store.set_archived(completed, true).unwrap();
    for id in ids {
        store.reopen(id, ExperimentState::Completed, "longer", "more", 7).unwrap();
    }
    let states = ids.map(|id| store.experiment(id).unwrap().unwrap());
    assert_eq!(states[0].state, ExperimentState::Running);
    assert_eq!((states[0].config_json.as_str(), states[0].is_archived), ("longer", false));
    assert_eq!(states[1].state, ExperimentState::Cancelled);
    assert_ne!(states[1].config_json, "longer");
    assert_eq!(store.events(cancelled, 1, 100).unwrap().len(), 2, "it has no further event");
    commit(&mut store, completed, 1, None).unwrap();
    store.reopen(cancelled, ExperimentState::Cancelled, "same", "resumed", 8).unwrap();
    commit(&mut store, cancelled, 0, None).unwrap();
}

#[test]
fn a_deleted_experiment_leaves_nothing_but_its_number() {
    let (directory, mut store) = open();
    let ids = [0, 1].map(|_| store.create(&new_experiment(Some("key")), 5).unwrap().0);
    assert_eq!(ids[0], ids[1]);
    let kept = store.create(&new_experiment(None), 5).unwrap().0;
    let [id, _] = ids;
    commit(&mut store, kept, 0, None).unwrap();
    commit(&mut store, id, 0, None).unwrap();
    assert!(matches!(store.delete(id), Err(StoreError::Unfinished(other)) if other == id));
    store.set_state(id, 6, ExperimentState::Cancelled, "enough").unwrap();
    store.delete(id).unwrap();
    assert!(store.experiment(id).unwrap().is_none());
    let n_rows = |table: &str| {
        let sql = format!("SELECT count(*) FROM {table} WHERE experiment_id = ?1");
        store.connection().query_row(&sql, [id.0], |row| row.get::<_, u64>(0)).unwrap()
    };
    let sql = "SELECT name FROM pragma_table_list AS t WHERE EXISTS
               (SELECT 1 FROM pragma_table_info(t.name) WHERE name = 'experiment_id')";
    let mut statement = store.connection().prepare(sql).unwrap();
    let tables: Vec<String> =
        statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
    drop(statement);
    assert!(tables.len() >= 6, "{tables:?}");
    assert!(tables.iter().all(|table| n_rows(table) == 0), "{tables:?}");

    // Late calls do no harm.
    store.notice(id, 7, "late").unwrap();
    assert!(matches!(commit(&mut store, id, 1, None), Err(StoreError::Ended(_))));
    let (again, is_new) = store.create(&new_experiment(Some("key")), 8).unwrap();
    assert!(is_new && again > kept, "numbers are not used again");
    drop(store);
    let findings = inspect(directory.path()).unwrap().findings;
    assert!(findings.iter().all(|finding| finding.experiment != Some(id)), "{findings:?}");
}

#[test]
fn labels_and_the_archive_are_kept_through_recovery() {
    let (directory, mut store) = open();
    let labels = |text: &str| [("user".to_owned(), text.to_owned())].into();
    let new = NewExperiment { labels: labels("ada"), ..new_experiment(None) };
    let (id, _) = store.create(&new, 5).unwrap();
    assert_eq!(store.experiment(id).unwrap().unwrap().labels, labels("ada"));
    store.set_labels(id, &labels("grace")).unwrap();
    store.set_archived(id, true).unwrap();
    assert!(!store.experiment(id).unwrap().unwrap().is_archived, "it goes on");
    commit(&mut store, id, 0, Some("")).unwrap();
    store.set_archived(id, true).unwrap();
    drop(store);
    let copy = directory.path().join("copy");
    recover(directory.path(), &copy).unwrap();
    let found = Store::open(&copy).unwrap().experiment(id).unwrap().unwrap().record;
    assert_eq!((found.labels, found.is_archived), (labels("grace"), true));
    assert_eq!(found.recent_generation_ms, None, "no generation is left");
}

#[test]
fn a_generation_that_cannot_be_committed_leaves_nothing_behind() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    commit(&mut store, id, 0, None).unwrap();
    let before = store.events(id, 1, 100).unwrap();
    assert!(commit(&mut store, id, 0, None).is_err(), "a generation is committed once");
    assert_eq!(store.events(id, 1, 100).unwrap(), before);
    assert_eq!(store.resumable(id).unwrap().1, checkpoint_after(0));
}

#[test]
fn pruning_frees_the_log_of_an_ended_experiment_and_keeps_its_latest_state() {
    let (directory, mut store) = open();
    let ids = [0, 1].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
    for number in 0..3 {
        commit(&mut store, ids[1], number, None).unwrap();
        commit(&mut store, ids[0], number, (number == 2).then_some("")).unwrap();
    }
    let refused = store.prune(ids[1], 3, None, 7);
    assert!(matches!(refused, Err(StoreError::Unfinished(id)) if id == ids[1]), "{refused:?}");
    store.set_state(ids[1], 7, ExperimentState::Cancelled, "enough").unwrap();
    let history = store.generations(ids[0], 0, 9).unwrap();

    assert!(store.prune(ids[0], 3, Some(b"now"), 8).unwrap() > 0);
    assert!(store.prune(ids[1], 3, None, 8).unwrap() > 0);
    assert_eq!(store.prune(ids[0], 3, Some(b"now"), 9).unwrap(), 0, "it is pruned already");
    let now = Checkpoint { keyframe: b"now".to_vec(), ..Checkpoint::default() };
    assert_eq!(store.resumable(ids[0]).unwrap().1, now);
    assert!(store.resumable(ids[1]).is_err(), "nothing continues from it");
    for id in ids {
        let found = store.experiment(id).unwrap().unwrap();
        assert_eq!((found.log_from, found.log_gap), (3, LogGap::Pruned));
        assert!(store.champion(id).unwrap().is_some());
    }
    assert_eq!(store.generations(ids[0], 0, 9).unwrap(), history);
    store.reopen(ids[0], ExperimentState::Completed, "longer", "more", 10).unwrap();
    commit(&mut store, ids[0], 3, None).unwrap();
    let keyframe = b"now".to_vec();
    let log = vec![b"told 3".to_vec()];
    assert_eq!(store.resumable(ids[0]).unwrap().1, Checkpoint { keyframe, log, n_flat: 0 });
    drop(store);
    let problems = inspect(directory.path()).unwrap().findings;
    assert!(problems.iter().all(|problem| !problem.what.contains("keyframe")), "{problems:?}");
}

#[test]
fn an_experiment_that_went_on_since_its_state_was_read_is_not_pruned() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    commit(&mut store, id, 0, Some("")).unwrap();
    store.reopen(id, ExperimentState::Completed, "longer", "more", 6).unwrap();
    commit(&mut store, id, 1, Some("")).unwrap();
    let refused = store.prune(id, 1, Some(b"after 0"), 7).unwrap_err();
    assert!(matches!(refused, StoreError::WentOn(other) if other == id), "{refused}");
    assert_eq!(store.resumable(id).unwrap().1, checkpoint_after(1), "nothing is deleted");
    assert!(store.prune(id, 2, Some(b"after 1"), 8).unwrap() > 0);
}

#[test]
fn unknown_experiments_are_none() {
    let (_directory, store) = open();
    for id in [0, 1, u64::MAX] {
        assert!(store.experiment(ExperimentId(id)).unwrap().is_none());
    }
}

#[test]
fn a_wall_clock_that_jumps_changes_no_order() {
    let (directory, mut store) = open();
    let far_future = 1 << 50;
    let (first, _) = store.create(&new_experiment(None), far_future).unwrap();
    commit(&mut store, first, 0, None).unwrap(); // At 1 s after 1970.
    let (second, _) = store.create(&new_experiment(None), 0).unwrap();
    store.set_state(first, far_future + 1, ExperimentState::Cancelled, "enough").unwrap();
    drop(store);

    let store = Store::open(directory.path()).unwrap();
    let ids: Vec<ExperimentId> =
        store.experiments(&Filter::default()).unwrap().iter().map(|e| e.id).collect();
    assert_eq!(ids, [first, second], "by id, not by time of submission");
    let events = store.events(first, 1, 100).unwrap();
    let times: Vec<u64> = events.iter().map(|event| event.at_ms).collect();
    assert_eq!(times, [far_future, 1000, 1000, far_future + 1]);
    let sequences: Vec<u64> = events.iter().map(|event| event.sequence).collect();
    assert_eq!(sequences, [1, 2, 3, 4]);
}

#[test]
fn a_coordinator_killed_while_it_creates_the_database_creates_it_again() {
    let directory = tempfile::tempdir().unwrap();
    let unfinished = directory.path().join("swarmevo.sqlite3.new");
    fs::write(&unfinished, "half a datab").unwrap();
    let mut store = Store::open(directory.path()).unwrap();
    store.create(&new_experiment(None), 5).unwrap();
    assert!(!unfinished.exists());
}

#[test]
fn a_pause_keeps_its_reason_and_still_takes_an_evaluated_generation() {
    let (directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    store.set_state(id, 6, ExperimentState::Paused, "for lunch").unwrap();
    store.set_state(id, 7, ExperimentState::Paused, "for dinner").unwrap();
    store.set_state(id, 7, ExperimentState::Paused, "for dinner").unwrap();
    commit(&mut store, id, 0, None).unwrap();
    drop(store);

    let mut store = Store::open(directory.path()).unwrap();
    let state = |store: &Store| {
        let experiment = store.experiment(id).unwrap().unwrap().record;
        (experiment.state, experiment.reason)
    };
    assert_eq!(state(&store), (ExperimentState::Paused, "for dinner".to_owned()));
    store.set_state(id, 8, ExperimentState::Running, "").unwrap();
    assert_eq!(state(&store), (ExperimentState::Running, String::new()));
    let events = store.events(id, 1, 100).unwrap();
    let states = events.iter().filter_map(|event| match &event.kind {
        EventKind::State { state, .. } => Some(*state),
        _ => None,
    });
    let expected = [
        ExperimentState::Running,
        ExperimentState::Paused,
        ExperimentState::Paused,
        ExperimentState::Running,
    ];
    assert_eq!(states.collect::<Vec<_>>(), expected);
}

#[test]
fn a_priority_can_be_changed_until_the_end() {
    let (_directory, mut store) = open();
    let (id, _) = store.create(&new_experiment(None), 5).unwrap();
    let priority = |store: &Store| store.experiment(id).unwrap().unwrap().priority;
    assert_eq!(priority(&store), Priority::default());
    let high = Priority::new(1000).unwrap();
    store.set_priority(id, high).unwrap();
    assert_eq!(priority(&store), high);
    store.set_state(id, 6, ExperimentState::Cancelled, "enough").unwrap();
    store.set_priority(id, Priority::default()).unwrap();
    assert_eq!(priority(&store), high);
}

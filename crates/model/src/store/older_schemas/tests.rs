//! Databases of every released version.

use std::{fs, path::Path};

use rusqlite::Connection;

use super::super::{
    ExperimentState, Filter, Store, StoreError, file,
    inspection::{inspect, tests::advance_to},
    schema::{MIGRATIONS, SEALED, VERSION},
    tests::new_experiment,
};
use super::CONFIGS;

/// Replaces a directory's database by one of an older version. That version's own statements make
/// it, and the same rows fill its columns.
pub fn downgrade(directory: &Path, version: i64) {
    let path = file::path_in(directory);
    let latest = path.with_extension("latest");
    Connection::open(&path).unwrap().pragma_update(None, "journal_mode", "delete").unwrap();
    fs::rename(&path, &latest).unwrap();
    let older = Connection::open(&path).unwrap();
    older.execute("ATTACH ?1 AS latest", [latest.to_str().unwrap()]).unwrap();
    older.pragma_update(None, "foreign_keys", false).unwrap();
    for statements in &MIGRATIONS[..version as usize] {
        older.execute_batch(statements).unwrap();
    }
    for table in names(
        &older,
        "SELECT name FROM main.sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite_%'",
    ) {
        // Before the log, a row had the latest state, and another table the later steps.
        let source = match table.as_str() {
            "experiments" if version < CONFIGS => "SELECT * FROM latest.experiments JOIN latest.configs ON experiment_id = id",
            "checkpoints" if version < 5 => "SELECT experiment_id, CAST(state AS TEXT) AS state, seal FROM latest.keyframes ORDER BY n_generations",
            "checkpoints" => "SELECT * FROM latest.keyframes ORDER BY n_generations",
            "checkpoint_steps" => "SELECT *, told AS step FROM latest.fitness_log AS l WHERE generation >=
                (SELECT max(n_generations) FROM latest.keyframes AS k WHERE k.experiment_id = l.experiment_id)",
            table => &format!("SELECT * FROM latest.{table}"),
        };
        let statement = older.prepare(source).unwrap();
        let of_source: Vec<String> = statement.column_names().map(str::to_owned).collect();
        let mut columns =
            names(&older, &format!("SELECT name FROM main.pragma_table_info('{table}')"));
        columns.retain(|column| of_source.contains(column));
        let columns = columns.join(", ");
        older
            .execute_batch(&format!(
                "INSERT OR REPLACE INTO main.{table} ({columns}) SELECT {columns} FROM ({source})"
            ))
            .unwrap();
    }
    older.pragma_update(None, "user_version", version).unwrap();
    older.execute_batch("DETACH latest").unwrap();
    fs::remove_file(latest).unwrap();
}

fn names(connection: &Connection, sql: &str) -> Vec<String> {
    let mut statement = connection.prepare(sql).unwrap();
    statement.query_map([], |row| row.get(0)).unwrap().map(Result::unwrap).collect()
}

/// The data of each experiment that all versions have.
fn contents(store: &Store) -> Vec<String> {
    let experiments = store.experiments(&Filter::default()).unwrap();
    let all = experiments.iter().map(|experiment| {
        let id = experiment.id;
        let stored = store.experiment(id).unwrap().unwrap();
        format!(
            "{id:?} {} {:?} {} {} {:?} {:?} {:?}",
            stored.name,
            stored.state,
            stored.digest,
            stored.config_json,
            stored.latest,
            store.champion(id).unwrap(),
            store.generations(id, 0, 100).unwrap(),
        )
    });
    all.collect()
}

#[test]
fn databases_of_every_version_open_and_keep_their_data() {
    for version in 1..=VERSION {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let [running, ended, cancelled] =
            [0; 3].map(|_| store.create(&new_experiment(None), 5).unwrap().0);
        for id in [running, running, running, ended, ended, cancelled] {
            advance_to(true, &mut store, id, None);
        }
        advance_to(true, &mut store, ended, Some(""));
        store.set_state(cancelled, 9, ExperimentState::Cancelled, "enough").unwrap();
        let before = contents(&store);
        let keyframe = store.resumable(running).unwrap().1.keyframe;
        drop(store);
        downgrade(directory.path(), version);

        let path = file::path_in(directory.path());
        let bytes = fs::read(&path).unwrap();
        let inspection = inspect(directory.path()).unwrap();
        assert!(inspection.findings.is_empty(), "{version}: {:?}", inspection.findings);
        assert_eq!((inspection.schema_version, inspection.n_generations), (version, 7));
        match Store::open_read_only(directory.path()) {
            Ok(read) => assert_eq!(contents(&read), before, "{version}, without a change"),
            Err(StoreError::TooOld { .. }) if version < SEALED => {}
            Err(error) => panic!("{version}: {error}"),
        }
        assert!(fs::read(&path).unwrap() == bytes, "{version} was changed by readers");

        let mut store = Store::open(directory.path()).unwrap();
        assert_eq!(contents(&store), before, "{version}");
        let resumed = store.resumable(running).unwrap().1.keyframe;
        assert!(resumed == keyframe, "{version} goes on from another state");
        advance_to(true, &mut store, running, None);
        drop(store);
        assert!(inspect(directory.path()).unwrap().findings.is_empty(), "{version}");
    }
}

/// These statements made existing databases; after a change they would make databases that no
/// user has.
#[test]
fn released_migrations_stay_as_they_are() {
    let digests = MIGRATIONS
        .iter()
        .map(|statements| blake3::hash(statements.as_bytes()).to_hex()[..8].to_owned());
    assert_eq!(
        digests.collect::<Vec<_>>(),
        [
            "b9a7777d", "54864f37", "1799e364", "59bb63f0", "122ab170", "23bb2022", "0a27952a",
            "875bbdd8", "1addcd31", "1333a318", "d87a0e15", "36e4d691", "c01a736b"
        ]
    );
}

//! The database's schema, and the way from older versions to it.

use rusqlite::{Connection, TransactionBehavior};

use super::{StoreError, seals};

/// Statements that lead from version i to version i + 1. Never change an entry
/// that has been released; add one.
const MIGRATIONS: &[&str] = &[
    "
    CREATE TABLE experiments (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        -- The client's key against double submission.
        request_id TEXT UNIQUE,
        name TEXT NOT NULL,
        -- The experiment file in canonical form, seed included.
        config TEXT NOT NULL,
        config_digest TEXT NOT NULL,
        -- The simulation that computes it.
        fingerprint TEXT NOT NULL,
        genotype_len INTEGER NOT NULL,
        state TEXT NOT NULL CHECK (state IN ('running', 'completed', 'failed', 'cancelled')),
        reason TEXT NOT NULL DEFAULT '',
        submitted_at_ms INTEGER NOT NULL,
        -- The last link of the digest chain of re-evaluations, or of generations.
        digest TEXT NOT NULL DEFAULT ''
    ) STRICT;

    CREATE TABLE generations (
        experiment_id INTEGER NOT NULL REFERENCES experiments (id),
        generation INTEGER NOT NULL,
        best REAL NOT NULL,
        mean REAL NOT NULL,
        min REAL NOT NULL,
        standard_deviation REAL NOT NULL,
        digest TEXT NOT NULL,
        duration_ms INTEGER NOT NULL,
        episodes INTEGER NOT NULL,
        workers INTEGER NOT NULL,
        idle_share REAL NOT NULL,
        PRIMARY KEY (experiment_id, generation)
    ) STRICT, WITHOUT ROWID;

    -- Evolution after the latest generation, as JSON.
    CREATE TABLE checkpoints (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        state TEXT NOT NULL
    ) STRICT;

    CREATE TABLE champions (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        -- After which generation it was found.
        generation INTEGER NOT NULL,
        -- NULL: the mean of the distribution.
        individual INTEGER,
        -- JSON lists of numbers.
        trial_fitness TEXT NOT NULL,
        genotype TEXT NOT NULL,
        -- NULL before the first re-evaluation.
        held_out_mean REAL,
        held_out_ci95 REAL,
        held_out_trials INTEGER,
        held_out_generation INTEGER
    ) STRICT;

    CREATE TABLE events (
        experiment_id INTEGER NOT NULL REFERENCES experiments (id),
        -- From 1, without gaps, per experiment.
        sequence INTEGER NOT NULL,
        at_ms INTEGER NOT NULL,
        kind TEXT NOT NULL CHECK (kind IN ('generation', 'state', 'notice')),
        -- kind = generation: a row of `generations`.
        generation INTEGER,
        -- kind = state: the new state.
        state TEXT,
        -- kind = state: the reason; kind = notice: the text.
        message TEXT,
        PRIMARY KEY (experiment_id, sequence)
    ) STRICT, WITHOUT ROWID;
",
    // SQLite cannot change a CHECK, so the table is made anew.
    "
    CREATE TABLE experiments_with_priority (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        -- The client's key against double submission.
        request_id TEXT UNIQUE,
        name TEXT NOT NULL,
        -- The experiment file in canonical form, seed included.
        config TEXT NOT NULL,
        config_digest TEXT NOT NULL,
        -- The simulation that computes it.
        fingerprint TEXT NOT NULL,
        genotype_len INTEGER NOT NULL,
        state TEXT NOT NULL
              CHECK (state IN ('running', 'paused', 'completed', 'failed', 'cancelled')),
        reason TEXT NOT NULL DEFAULT '',
        submitted_at_ms INTEGER NOT NULL,
        -- The last link of the digest chain of re-evaluations, or of generations.
        digest TEXT NOT NULL DEFAULT '',
        -- Weight in the sharing of the fleet.
        priority INTEGER NOT NULL DEFAULT 100 CHECK (priority BETWEEN 1 AND 1000)
    ) STRICT;
    INSERT INTO experiments_with_priority
           (id, request_id, name, config, config_digest, fingerprint, genotype_len, state,
            reason, submitted_at_ms, digest)
    SELECT id, request_id, name, config, config_digest, fingerprint, genotype_len, state,
           reason, submitted_at_ms, digest
    FROM experiments;
    DROP TABLE experiments;
    ALTER TABLE experiments_with_priority RENAME TO experiments;
",
    "
    -- Of the database itself; one row.
    CREATE TABLE identity (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        -- Key of all seals.
        seal_key BLOB NOT NULL,
        -- Token of the coordinator that may write.
        owner BLOB NOT NULL,
        -- 1 in a main file that lacks its write-ahead log.
        needs_log INTEGER NOT NULL
    ) STRICT;
    INSERT INTO identity VALUES (1, randomblob(32), randomblob(16), 0);

    -- Keyed digests of the rows.
    ALTER TABLE experiments ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
    ALTER TABLE generations ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
    ALTER TABLE checkpoints ADD COLUMN seal BLOB NOT NULL DEFAULT x'';
    ALTER TABLE champions ADD COLUMN seal BLOB NOT NULL DEFAULT x'';

    -- From these, nothing can continue.
    DELETE FROM checkpoints WHERE experiment_id IN (
        SELECT id FROM experiments
        WHERE state IN ('failed', 'cancelled') OR (state = 'completed' AND reason <> ''));
",
    "
    CREATE TABLE quarantine (
        -- What the worker calls itself.
        name TEXT PRIMARY KEY,
        reason TEXT NOT NULL,
        since_ms INTEGER NOT NULL
    ) STRICT, WITHOUT ROWID;
",
    "
    CREATE TABLE checkpoints_of_bytes (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        -- Evolution after some generation, in the format of the crate `evolution`.
        state BLOB NOT NULL,
        seal BLOB NOT NULL DEFAULT x''
    ) STRICT;
    INSERT INTO checkpoints_of_bytes
    SELECT experiment_id, CAST(state AS BLOB), seal FROM checkpoints;
    DROP TABLE checkpoints;
    ALTER TABLE checkpoints_of_bytes RENAME TO checkpoints;

    -- What the generations since have added to that.
    CREATE TABLE checkpoint_steps (
        experiment_id INTEGER NOT NULL REFERENCES experiments (id),
        generation INTEGER NOT NULL,
        step BLOB NOT NULL,
        seal BLOB NOT NULL,
        PRIMARY KEY (experiment_id, generation)
    ) STRICT, WITHOUT ROWID;
",
    "
    -- Fitness on trials that selected nothing; NULL before the end of a run, and of champions
    -- of older versions, whose held-out fitness is all that there is.
    ALTER TABLE champions ADD COLUMN judged_mean REAL;
    ALTER TABLE champions ADD COLUMN judged_low REAL;
    ALTER TABLE champions ADD COLUMN judged_high REAL;
    ALTER TABLE champions ADD COLUMN judged_trials INTEGER;
    ALTER TABLE champions ADD COLUMN judged_generation INTEGER;
",
];

/// The first version with seals.
pub const SEALED: i64 = 3;

/// The first version with steps of checkpoints.
const WITH_STEPS: i64 = 5;

/// The first version with judged champions.
const JUDGED: i64 = 6;

/// The version that this code writes.
pub const VERSION: i64 = MIGRATIONS.len() as i64;

/// The version of a database; 0 if it is empty, or not one of ours.
pub fn version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.query_row("PRAGMA user_version", [], |row| row.get(0))
}

/// Brings a database to [`VERSION`].
pub fn migrate(connection: &mut Connection) -> Result<(), StoreError> {
    let found = usize::try_from(version(connection)?).unwrap_or(usize::MAX);
    // A table that others refer to can be replaced only while nobody checks; the
    // pragma means nothing within a transaction.
    connection.pragma_update(None, "foreign_keys", false)?;
    if found < MIGRATIONS.len() {
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        for statements in &MIGRATIONS[found..] {
            transaction.execute_batch(statements)?;
        }
        // What seals cover is read from the latest tables.
        if (found as i64) < SEALED {
            seals::seal_all(&transaction)?;
        }
        let n_dangling: i64 =
            transaction
                .query_row("SELECT count(*) FROM pragma_foreign_key_check", [], |row| row.get(0))?;
        if n_dangling > 0 {
            return Err(StoreError::Corrupt(format!(
                "{n_dangling} rows refer to experiments that do not exist"
            )));
        }
        transaction.pragma_update(None, "user_version", VERSION)?;
        transaction.commit()?;
    }
    connection.pragma_update(None, "foreign_keys", true)?;
    Ok(())
}

/// Lets a database of an older version be read as if it were of the latest, without
/// changing it. Seals that it does not have are empty.
pub fn read_as_latest(connection: &Connection, version: i64) -> rusqlite::Result<()> {
    // In the temporary schema, where names are looked up first.
    if version < WITH_STEPS {
        connection.execute_batch(
            "CREATE TEMP VIEW checkpoint_steps AS
             SELECT 0 AS experiment_id, 0 AS generation, x'' AS step, x'' AS seal WHERE false",
        )?;
    }
    let if_before = |first, columns| if version < first { columns } else { "" };
    let priority = if_before(2, ", 100 AS priority");
    let seal = if_before(SEALED, ", x'' AS seal");
    let judged = if_before(
        JUDGED,
        ", NULL AS judged_mean, NULL AS judged_low, NULL AS judged_high,
         NULL AS judged_trials, NULL AS judged_generation",
    );
    for (table, more) in
        [("experiments", priority), ("generations", ""), ("checkpoints", ""), ("champions", judged)]
    {
        connection.execute_batch(&format!(
            "CREATE TEMP VIEW {table} AS SELECT *{more}{seal} FROM main.{table}"
        ))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn experiments_of_the_first_schema_are_kept_and_may_be_paused() {
        let mut connection = Connection::open_in_memory().unwrap();
        connection.execute_batch(MIGRATIONS[0]).unwrap();
        connection
            .execute_batch(
                "INSERT INTO experiments (id, request_id, name, config, config_digest, fingerprint,
                                          genotype_len, state, reason, submitted_at_ms, digest)
                 VALUES (3, 'key', 'n', '{}', 'd', 'f', 5, 'failed', 'why', 7, 'link');
                 INSERT INTO checkpoints VALUES (3, 'checkpoint');
                 PRAGMA user_version = 1;",
            )
            .unwrap();
        migrate(&mut connection).unwrap();
        assert_eq!(version(&connection).unwrap(), VERSION);
        let row =
            "SELECT id || request_id || state || reason || digest || priority FROM experiments";
        let text =
            |sql: &str| connection.query_row(sql, [], |row| row.get::<_, String>(0)).unwrap();
        assert_eq!(text(row), "3keyfailedwhylink100");
        assert_eq!(text("SELECT count(*) || '' FROM checkpoints"), "0", "nothing can use it");
        connection.execute("UPDATE experiments SET state = 'paused'", []).unwrap();
        connection
            .execute("INSERT INTO checkpoints (experiment_id, state) VALUES (9, x'')", [])
            .expect_err("references are checked again");
        connection
            .execute(
                "INSERT INTO experiments SELECT NULL, NULL, name, config, config_digest,
                      fingerprint, genotype_len, state, reason, submitted_at_ms, digest, priority,
                      seal FROM experiments",
                [],
            )
            .unwrap();
        assert_eq!(connection.last_insert_rowid(), 4, "ids are not reused");
    }
}

//! The database's schema, and the migrations from older versions.

use rusqlite::{Connection, TransactionBehavior};

use super::{StoreError, sealing};

/// Makes the column `summary` from a column `config`: a list of the fields of
/// [`Summary`](super::Summary). `->` keeps all digits of a seed. This is part of a migration, so
/// it never changes.
macro_rules! summary {
    () => {
        "CASE WHEN json_valid(config) THEN json_array(
             config -> '$.seed', config -> '$.algorithm.generations', config -> '$.algorithm.name',
             config -> '$.algorithm.population_size', config -> '$.algorithm.num_evaluations',
             config -> '$.algorithm.champion_trials', config -> '$.algorithm.judgement_trials',
             length(CAST(config AS BLOB))) END"
    };
}

pub(super) use summary;

/// Statements that lead from version i to version i + 1. Never change an entry
/// that has been released; add one.
pub(super) const MIGRATIONS: &[&str] = &[
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
    // SQLite cannot change a CHECK, so the migration creates the table again.
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
    "
    -- The group that an experiment belongs to, and what is particular about it there; NULL if
    -- it belongs to none.
    ALTER TABLE experiments ADD COLUMN group_name TEXT;
    ALTER TABLE experiments ADD COLUMN variant TEXT;
",
    "
    -- What evolution was told of each generation, in the format of the crate `evolution`.
    CREATE TABLE fitness_log (
        experiment_id INTEGER NOT NULL REFERENCES experiments (id),
        generation INTEGER NOT NULL,
        told BLOB NOT NULL,
        seal BLOB NOT NULL,
        PRIMARY KEY (experiment_id, generation)
    ) STRICT, WITHOUT ROWID;
    INSERT INTO fitness_log SELECT experiment_id, generation, step, seal FROM checkpoint_steps;

    CREATE TABLE keyframes (
        experiment_id INTEGER NOT NULL REFERENCES experiments (id),
        -- The generations before it.
        n_generations INTEGER NOT NULL,
        -- Evolution after them, in the format of the crate `evolution`.
        state BLOB NOT NULL,
        seal BLOB NOT NULL,
        PRIMARY KEY (experiment_id, n_generations)
    ) STRICT;
    INSERT INTO keyframes
    SELECT experiment_id,
           (SELECT count(*) FROM generations AS g WHERE g.experiment_id = c.experiment_id)
           - (SELECT count(*) FROM checkpoint_steps AS s WHERE s.experiment_id = c.experiment_id),
           state, seal
    FROM checkpoints AS c;
    DROP TABLE checkpoints;
    DROP TABLE checkpoint_steps;

    -- The first generation in the log; one that is not complete if there is none.
    ALTER TABLE experiments ADD COLUMN log_from INTEGER NOT NULL DEFAULT 0;
    -- Why that is not generation 0.
    ALTER TABLE experiments ADD COLUMN log_gap TEXT NOT NULL DEFAULT ''
          CHECK (log_gap IN ('', 'older', 'pruned', 'damaged', 'forked'));
    UPDATE experiments SET log_from = ifnull(
        (SELECT n_generations FROM keyframes WHERE experiment_id = id),
        (SELECT count(*) FROM generations WHERE experiment_id = id));
    UPDATE experiments SET log_gap = 'older' WHERE log_from > 0;
",
    "
    -- Experiments that go on from the state of another one, whose history up to there is
    -- theirs, too.
    CREATE TABLE forks (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        -- The experiment may be gone, in a recovered database.
        parent_id INTEGER NOT NULL,
        -- The last generation of the parent that is shared.
        generation INTEGER NOT NULL,
        -- The link of the digest chain on which the next generation hangs.
        link TEXT NOT NULL,
        -- What is changed: a JSON list of lines.
        changes TEXT NOT NULL,
        seal BLOB NOT NULL
    ) STRICT;
",
    "
    -- What people find an experiment by: a JSON object of text.
    ALTER TABLE experiments ADD COLUMN labels TEXT NOT NULL DEFAULT '{}';
    -- Whether lists leave it out.
    ALTER TABLE experiments ADD COLUMN archived INTEGER NOT NULL DEFAULT 0
          CHECK (archived IN (0, 1));
",
    // Lists of many experiments omit the files. These come last in their rows, because SQLite
    // reads a row only up to the last column that it needs.
    concat!(
        "
    CREATE TABLE listed_experiments (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        request_id TEXT UNIQUE,
        name TEXT NOT NULL,
        config_digest TEXT NOT NULL,
        fingerprint TEXT NOT NULL,
        genotype_len INTEGER NOT NULL,
        state TEXT NOT NULL
              CHECK (state IN ('running', 'paused', 'completed', 'failed', 'cancelled')),
        reason TEXT NOT NULL DEFAULT '',
        submitted_at_ms INTEGER NOT NULL,
        digest TEXT NOT NULL DEFAULT '',
        priority INTEGER NOT NULL DEFAULT 100 CHECK (priority BETWEEN 1 AND 1000),
        seal BLOB NOT NULL DEFAULT x'',
        group_name TEXT,
        variant TEXT,
        log_from INTEGER NOT NULL DEFAULT 0,
        log_gap TEXT NOT NULL DEFAULT ''
                CHECK (log_gap IN ('', 'older', 'pruned', 'damaged', 'forked')),
        labels TEXT NOT NULL DEFAULT '{}',
        archived INTEGER NOT NULL DEFAULT 0 CHECK (archived IN (0, 1)),
        -- Some keys of the file, as a JSON list.
        summary TEXT GENERATED ALWAYS AS (",
        summary!(),
        ") STORED,
        config TEXT NOT NULL
    ) STRICT;
    INSERT INTO listed_experiments
           (id, request_id, name, config_digest, fingerprint, genotype_len, state, reason,
            submitted_at_ms, digest, priority, seal, group_name, variant, log_from, log_gap,
            labels, archived, config)
    SELECT id, request_id, name, config_digest, fingerprint, genotype_len, state, reason,
           submitted_at_ms, digest, priority, seal, group_name, variant, log_from, log_gap,
           labels, archived, config
    FROM experiments;
    -- Numbers of deleted experiments are not used again.
    DELETE FROM sqlite_sequence WHERE name = 'listed_experiments';
    UPDATE sqlite_sequence SET name = 'listed_experiments' WHERE name = 'experiments';
    DROP TABLE experiments;
    ALTER TABLE listed_experiments RENAME TO experiments;
    CREATE INDEX experiments_by_name ON experiments (name);
    CREATE INDEX experiments_by_group ON experiments (group_name);
    CREATE INDEX experiments_by_digest ON experiments (config_digest);
    CREATE INDEX experiments_by_state ON experiments (state);
"
    ),
    // Lists of many experiments omit the genes, too.
    "
    CREATE TABLE listed_champions (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        generation INTEGER NOT NULL,
        individual INTEGER,
        held_out_mean REAL,
        held_out_ci95 REAL,
        held_out_trials INTEGER,
        held_out_generation INTEGER,
        judged_mean REAL,
        judged_low REAL,
        judged_high REAL,
        judged_trials INTEGER,
        judged_generation INTEGER,
        seal BLOB NOT NULL DEFAULT x'',
        trial_fitness TEXT NOT NULL,
        genotype TEXT NOT NULL
    ) STRICT;
    INSERT INTO listed_champions
    SELECT experiment_id, generation, individual, held_out_mean, held_out_ci95, held_out_trials,
           held_out_generation, judged_mean, judged_low, judged_high, judged_trials,
           judged_generation, seal, trial_fitness, genotype
    FROM champions;
    DROP TABLE champions;
    ALTER TABLE listed_champions RENAME TO champions;
",
    // With the files in their rows, a list would still read a page for each experiment.
    "
    CREATE TABLE configs (
        experiment_id INTEGER PRIMARY KEY REFERENCES experiments (id),
        -- The experiment file in canonical form, seed included.
        config TEXT NOT NULL
    ) STRICT;
    INSERT INTO configs SELECT id, config FROM experiments ORDER BY id;

    CREATE TABLE narrow_experiments (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        request_id TEXT UNIQUE,
        name TEXT NOT NULL,
        config_digest TEXT NOT NULL,
        fingerprint TEXT NOT NULL,
        genotype_len INTEGER NOT NULL,
        state TEXT NOT NULL
              CHECK (state IN ('running', 'paused', 'completed', 'failed', 'cancelled')),
        reason TEXT NOT NULL DEFAULT '',
        submitted_at_ms INTEGER NOT NULL,
        digest TEXT NOT NULL DEFAULT '',
        priority INTEGER NOT NULL DEFAULT 100 CHECK (priority BETWEEN 1 AND 1000),
        seal BLOB NOT NULL DEFAULT x'',
        group_name TEXT,
        variant TEXT,
        log_from INTEGER NOT NULL DEFAULT 0,
        log_gap TEXT NOT NULL DEFAULT ''
                CHECK (log_gap IN ('', 'older', 'pruned', 'damaged', 'forked')),
        labels TEXT NOT NULL DEFAULT '{}',
        archived INTEGER NOT NULL DEFAULT 0 CHECK (archived IN (0, 1)),
        -- Some keys of the file, as a JSON list; NULL if the file is not JSON.
        summary TEXT
    ) STRICT;
    INSERT INTO narrow_experiments
    SELECT id, request_id, name, config_digest, fingerprint, genotype_len, state, reason,
           submitted_at_ms, digest, priority, seal, group_name, variant, log_from, log_gap,
           labels, archived, summary
    FROM experiments ORDER BY id;
    -- Numbers of deleted experiments are not used again.
    DELETE FROM sqlite_sequence WHERE name = 'narrow_experiments';
    UPDATE sqlite_sequence SET name = 'narrow_experiments' WHERE name = 'experiments';
    DROP TABLE experiments;
    ALTER TABLE narrow_experiments RENAME TO experiments;
    CREATE INDEX experiments_by_name ON experiments (name);
    CREATE INDEX experiments_by_group ON experiments (group_name);
    CREATE INDEX experiments_by_digest ON experiments (config_digest);
    CREATE INDEX experiments_by_state ON experiments (state);
",
];

/// The first version with seals.
pub const SEALED: i64 = 3;

/// The version that this code writes.
pub const VERSION: i64 = MIGRATIONS.len() as i64;

/// The version of a database; 0 if it is empty, or belongs to another program.
pub fn version(connection: &Connection) -> rusqlite::Result<i64> {
    connection.query_row("PRAGMA user_version", [], |row| row.get(0))
}

/// Brings a database to [`VERSION`].
pub fn migrate(connection: &mut Connection) -> Result<(), StoreError> {
    let found = usize::try_from(version(connection)?).unwrap_or(usize::MAX);
    // A referenced table can be replaced only while SQLite does not check foreign keys; the
    // pragma has no effect within a transaction.
    connection.pragma_update(None, "foreign_keys", false)?;
    if found < MIGRATIONS.len() {
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        for statements in &MIGRATIONS[found..] {
            transaction.execute_batch(statements).map_err(of_other_tables)?;
        }
        // Sealing reads the latest tables.
        if (found as i64) < SEALED {
            sealing::seal_all(&transaction)?;
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

/// The first missing table or column of a database that should have the latest version.
pub fn missing(connection: &Connection) -> Option<String> {
    let tables = [
        "experiments",
        "configs",
        "generations",
        "events",
        "champions",
        "fitness_log",
        "keyframes",
        "forks",
    ];
    tables.iter().find_map(|table| {
        let key = if *table == "experiments" { "id" } else { "experiment_id" };
        let looked = connection.prepare(&format!("SELECT {key} FROM {table} LIMIT 0"));
        match looked.err()? {
            rusqlite::Error::SqlInputError { msg, .. } => Some(msg),
            error => Some(error.to_string()),
        }
    })
}

/// Why a database cannot be migrated. Elsewhere, such an error is a bug; here it shows another
/// schema.
fn of_other_tables(error: rusqlite::Error) -> StoreError {
    let error = match StoreError::from(error) {
        StoreError::Bug(error) => error.to_string(),
        other => return other,
    };
    let what = error.lines().next().unwrap_or_default();
    StoreError::Corrupt(format!("its tables are not those of its version: {what}"))
}

#[cfg(test)]
mod tests;

//! The database's schema, and the way from older versions to it.

use rusqlite::{Connection, TransactionBehavior};

use super::StoreError;

/// Statements that lead from version i to version i + 1. Never change an entry
/// that has been released; add one.
const MIGRATIONS: &[&str] = &["
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
"];

/// The version that this code writes.
const VERSION: i64 = MIGRATIONS.len() as i64;

/// The version of a database; refuses a newer one than this code knows.
pub fn check_version(connection: &Connection) -> Result<usize, StoreError> {
    let found: i64 = connection.query_row("PRAGMA user_version", [], |row| row.get(0))?;
    match usize::try_from(found) {
        Ok(version) if version <= MIGRATIONS.len() => Ok(version),
        _ => Err(StoreError::Newer { found, supported: VERSION }),
    }
}

/// Brings a database to [`VERSION`].
pub fn migrate(connection: &mut Connection) -> Result<(), StoreError> {
    let found = check_version(connection)?;
    for (version, statements) in MIGRATIONS.iter().enumerate().skip(found) {
        let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
        transaction.execute_batch(statements)?;
        transaction.pragma_update(None, "user_version", version as i64 + 1)?;
        transaction.commit()?;
    }
    Ok(())
}

//! Deletes experiments, and measures their space in the database.

use rusqlite::Transaction;

use super::{Result, Store, StoreError, experiments, fitness_log, forks};
use crate::ids::ExperimentId;

/// The tables with rows of experiments; referenced tables come last.
const TABLES: [&str; 7] =
    ["fitness_log", "keyframes", "champions", "events", "generations", "forks", "configs"];

impl Store {
    /// Deletes an experiment that has ended, with all its data; its number is never used again.
    /// Fails with [`StoreError::NeededByForks`] if it has forks. Returns the number of freed
    /// bytes.
    pub fn delete(&mut self, id: ExperimentId) -> Result<u64> {
        self.write(|transaction, _| {
            let Some(found) = experiments::get(transaction, id)? else { return Ok(0) };
            if found.state.is_unfinished() {
                return Err(StoreError::Unfinished(id));
            }
            // Forks and their forks depend on the experiment even if its own log is gone.
            forks::check_unneeded(transaction, id, 0)?;
            let free_before = free_len(transaction)?;
            for table in TABLES {
                let sql = format!("DELETE FROM {table} WHERE experiment_id = ?1");
                transaction.execute(&sql, [id.0])?;
            }
            transaction.execute("DELETE FROM experiments WHERE id = ?1", [id.0])?;
            Ok(free_len(transaction)?.saturating_sub(free_before))
        })
    }

    /// Bytes of an experiment's fitness log and its keyframes.
    pub fn log_len(&self, id: ExperimentId) -> Result<u64> {
        self.read(|connection| Ok(fitness_log::len(connection, id)?))
    }
}

/// Bytes of the database's free pages.
fn free_len(transaction: &Transaction<'_>) -> rusqlite::Result<u64> {
    let number = |sql: &str| transaction.query_row(sql, [], |row| row.get::<_, u64>(0));
    Ok(number("PRAGMA freelist_count")? * number("PRAGMA page_size")?)
}

//! Deleting an experiment, and what it takes of the database.

use rusqlite::Transaction;

use super::{Result, Store, StoreError, experiments, fitness_log, forks};
use crate::ids::ExperimentId;

/// The tables with rows of experiments, those that others refer to last.
const TABLES: [&str; 6] =
    ["fitness_log", "keyframes", "champions", "events", "generations", "forks"];

impl Store {
    /// Deletes an experiment that has ended, with all that belongs to it; its number is not
    /// used again. [`StoreError::NeededByForks`] if it has forks. Returns how many bytes of the
    /// database that frees.
    pub fn delete(&mut self, id: ExperimentId) -> Result<u64> {
        self.write(|transaction, _| {
            let Some(found) = experiments::get(transaction, id)? else { return Ok(0) };
            if found.state.is_unfinished() {
                return Err(StoreError::Unfinished(id));
            }
            // Forks of forks lead here, too, so it is kept even if its own log is gone.
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

/// Bytes of the database's pages that hold nothing.
fn free_len(transaction: &Transaction<'_>) -> rusqlite::Result<u64> {
    let number = |sql: &str| transaction.query_row(sql, [], |row| row.get::<_, u64>(0));
    Ok(number("PRAGMA freelist_count")? * number("PRAGMA page_size")?)
}

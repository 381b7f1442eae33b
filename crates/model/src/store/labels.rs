//! The columns of experiments that belong to people: labels and the archive.

use rusqlite::params;

use super::{Result, Store};
use crate::{ids::ExperimentId, labels::Labels};

impl Store {
    /// Replaces an experiment's labels.
    pub fn set_labels(&mut self, id: ExperimentId, labels: &Labels) -> Result<()> {
        self.write(|transaction, _| {
            let sql = "UPDATE experiments SET labels = ?2 WHERE id = ?1";
            transaction.execute(sql, params![id.0, to_json(labels)])?;
            Ok(())
        })
    }

    /// Marks an ended experiment as archived, or removes the mark; leaves an unfinished one
    /// alone.
    pub fn set_archived(&mut self, id: ExperimentId, is_archived: bool) -> Result<()> {
        self.write(|transaction, _| {
            let sql = "UPDATE experiments SET archived = ?2
                       WHERE id = ?1 AND state NOT IN ('running', 'paused')";
            transaction.execute(sql, params![id.0, is_archived])?;
            Ok(())
        })
    }
}

/// Labels in the format of the database.
pub fn to_json(labels: &Labels) -> String {
    serde_json::to_string(labels).expect("text serialises")
}

/// Reads labels. Ignores invalid ones, because no result depends on them, and the experiment
/// should stay readable.
pub fn from_json(json: &str) -> Labels {
    serde_json::from_str(json).unwrap_or_default()
}

//! The table of workers in quarantine.

use rusqlite::{Connection, params};

use super::{Result, Store};

/// A worker that is proved faulty, and gets no items until an operator readmits it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuarantinedWorker {
    /// Its name.
    pub name: String,
    /// Why, for people.
    pub reason: String,
}

impl Store {
    /// Adds a worker; does nothing if it is in quarantine already.
    pub fn quarantine(&mut self, worker: &QuarantinedWorker, now_ms: u64) -> Result<()> {
        self.write(|transaction, _| {
            transaction.execute(
                "INSERT INTO quarantine (name, reason, since_ms) VALUES (?1, ?2, ?3)
                 ON CONFLICT (name) DO NOTHING",
                params![worker.name, worker.reason, now_ms],
            )?;
            Ok(())
        })
    }

    /// Lets a worker out of quarantine, if it is there.
    pub fn readmit(&mut self, name: &str) -> Result<()> {
        self.write(|transaction, _| {
            transaction.execute("DELETE FROM quarantine WHERE name = ?1", [name])?;
            Ok(())
        })
    }

    /// The workers in quarantine, by name.
    pub fn quarantined(&self) -> Result<Vec<QuarantinedWorker>> {
        let mut statement =
            self.connection.prepare("SELECT name, reason FROM quarantine ORDER BY name")?;
        let worker = |row: &rusqlite::Row<'_>| {
            Ok(QuarantinedWorker { name: row.get(0)?, reason: row.get(1)? })
        };
        Ok(statement.query_map([], worker)?.collect::<rusqlite::Result<_>>()?)
    }
}

/// Copies the readable rows of the quarantine to another database; older databases have none.
pub fn copy(from: &Connection, to: &Connection) -> Result<()> {
    let Ok(mut statement) = from.prepare("SELECT name, reason, since_ms FROM quarantine") else {
        return Ok(());
    };
    let row = |row: &rusqlite::Row<'_>| {
        Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?, row.get::<_, i64>(2)?))
    };
    for worker in statement.query_map([], row)?.map_while(rusqlite::Result::ok) {
        let sql = "INSERT OR IGNORE INTO quarantine VALUES (?1, ?2, ?3)";
        to.execute(sql, worker)?;
    }
    Ok(())
}

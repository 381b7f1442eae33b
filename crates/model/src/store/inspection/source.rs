//! A database that may be damaged, opened for reading.

use std::{collections::BTreeSet, path::Path};

use rusqlite::Connection;

use super::super::{
    Result, StoreError, file, older_schemas, schema, seals::Sealer, write_ahead_log,
};
use crate::ids::ExperimentId;

/// Most lines of SQLite's own check to report.
const DAMAGE_MAX: u32 = 20;
/// Most ids to try one by one, because damage can look like any number.
const IDS_MAX: u64 = 1 << 20;

/// A database as it was at one moment.
pub struct Source {
    /// Never written to.
    pub connection: Connection,
    /// Version of its schema.
    pub version: i64,
    /// `None` if the database has no seals, or has lost their key; then only digests are checked.
    pub sealer: Option<Sealer>,
    /// The damage of the database as a whole.
    pub damage: Vec<String>,
}

impl Source {
    /// Opens a database; a coordinator may use it meanwhile.
    pub fn open(path: &Path) -> Result<Self> {
        file::must_exist(path)?;
        let has_log = write_ahead_log::exists(path);
        let connection = file::open_read_only(path)?;
        let mut damage = structure(&connection);
        // Allows reading all existing pages, even if the end of the file is missing.
        connection.pragma_update(None, "writable_schema", true)?;
        // From now on, all reads see the state of one moment.
        connection.execute_batch("BEGIN")?;
        let version = match schema::version(&connection) {
            Ok(version) if version > schema::VERSION => {
                return Err(StoreError::Newer { found: version, supported: schema::VERSION });
            }
            Ok(version) => version,
            Err(error) => match StoreError::from(error) {
                StoreError::Corrupt(_) => 0,
                error => return Err(error),
            },
        };
        if version <= 0 && damage.is_empty() {
            damage.push("it has no tables of experiments".to_owned());
        }
        let mut sealer = None;
        if version >= schema::SEALED {
            if !has_log && write_ahead_log::is_missed(&connection).unwrap_or_default() {
                damage.push(
                    "it was copied while in use, without its write-ahead log: the latest \
                     generations are missing"
                        .to_owned(),
                );
            }
            match Sealer::from_database(&connection) {
                Ok(found) => sealer = Some(found),
                Err(error) => damage.push(format!("the key of its seals is lost: {error}")),
            }
        }
        if (1..schema::VERSION).contains(&version) {
            older_schemas::read_as_latest(&connection, version)?;
        }
        if damage.is_empty() {
            damage.extend(
                schema::missing(&connection).map(|what| {
                    format!("its tables are not those of its version, {version}: {what}")
                }),
            );
        }
        Ok(Self { connection, version, sealer, damage })
    }

    /// All experiments, including unreadable ones.
    pub fn experiments(&self) -> Vec<ExperimentId> {
        let mut ids = BTreeSet::new();
        for sql in [
            "SELECT id FROM experiments ORDER BY id",
            "SELECT id FROM experiments ORDER BY id DESC",
            "SELECT experiment_id FROM keyframes ORDER BY experiment_id DESC LIMIT 1",
            "SELECT experiment_id FROM generations ORDER BY experiment_id DESC LIMIT 1",
            "SELECT experiment_id FROM events ORDER BY experiment_id DESC LIMIT 1",
        ] {
            let Ok(mut statement) = self.connection.prepare(sql) else { continue };
            let Ok(rows) = statement.query_map([], |row| row.get::<_, u64>(0)) else { continue };
            ids.extend(rows.map_while(std::result::Result::ok));
        }
        let last = ids.last().copied().unwrap_or_default();
        ids.extend((1..last.min(IDS_MAX)).filter(|&id| self.may_have(id)));
        ids.into_iter().map(ExperimentId).collect()
    }

    /// Whether the experiment exists, or may exist.
    fn may_have(&self, id: u64) -> bool {
        let sql = "SELECT count(*) FROM experiments WHERE id = ?1";
        self.connection.query_row(sql, [id], |row| row.get(0)).unwrap_or(true)
    }
}

/// The damage that SQLite itself finds.
fn structure(connection: &Connection) -> Vec<String> {
    let lines = |sql: &str| {
        let mut statement = connection.prepare(sql)?;
        let rows = statement.query_map([], |row| row.get::<_, String>(0))?;
        rows.collect::<rusqlite::Result<Vec<_>>>()
    };
    let mut damage = match lines(&format!("PRAGMA integrity_check({DAMAGE_MAX})")) {
        Ok(lines) => lines,
        Err(error) => vec![error.to_string()],
    };
    damage.retain(|line| line != "ok");
    damage.iter_mut().for_each(|line| *line = line.replace('\n', " "));
    if damage.is_empty() {
        let dangling = "SELECT DISTINCT 'rows of ' || \"table\" || ' belong to no experiment'
                        FROM pragma_foreign_key_check";
        damage = lines(dangling).unwrap_or_else(|error| vec![error.to_string()]);
    }
    damage
}

//! The history of an experiment: its events and its generations.

use rusqlite::{Connection, Row, Transaction, params, types::Type};

use crate::ids::ExperimentId;
use evolution::{Real, Statistics};

use super::{
    Event, EventKind, ExperimentState, GenerationRecord, Result, Store, StoreError, seals::Sealer,
};

impl Store {
    /// At most `limit` events from `from_sequence` on.
    pub fn events(&self, id: ExperimentId, from_sequence: u64, limit: u32) -> Result<Vec<Event>> {
        self.read(|connection| {
            let mut statement = connection.prepare_cached(
                "SELECT v.sequence, v.at_ms, v.kind, v.state, v.message,
                    g.generation, g.best, g.mean, g.min, g.standard_deviation, g.digest,
                    g.duration_ms, g.episodes, g.workers, g.idle_share
             FROM events v
             LEFT JOIN generations g
                    ON g.experiment_id = v.experiment_id AND g.generation = v.generation
             WHERE v.experiment_id = ?1 AND v.sequence >= ?2
             ORDER BY v.sequence LIMIT ?3",
            )?;
            let from_sequence = i64::try_from(from_sequence).unwrap_or(i64::MAX);
            let rows = statement.query_map(params![id.0, from_sequence, limit], |row| {
                let (sequence, at_ms) = (row.get(0)?, row.get(1)?);
                let message = row.get::<_, Option<String>>(4)?.unwrap_or_default();
                let kind = match row.get::<_, String>(2)?.as_str() {
                    "generation" => read_generation(row, 5)?.map(EventKind::Generation),
                    "state" => {
                        let state: Option<String> = row.get(3)?;
                        state
                            .and_then(|name| ExperimentState::from_name(&name))
                            .map(|state| EventKind::State { state, reason: message })
                    }
                    _ => Some(EventKind::Notice(message)),
                };
                Ok(kind
                    .map(|kind| Event { sequence, at_ms, kind })
                    .ok_or_else(|| StoreError::Corrupt(format!("event {sequence} of {id}"))))
            })?;
            rows.map(|row| row?).collect()
        })
    }

    /// At most `limit` completed generations from `from_generation` on, each with its time of
    /// completion in milliseconds since 1970 UTC.
    pub fn generations(
        &self,
        id: ExperimentId,
        from_generation: u64,
        limit: u32,
    ) -> Result<Vec<(u64, GenerationRecord)>> {
        self.read(|connection| {
            // Events begin with the submission, and every generation has one, so the query can
            // skip events of earlier generations.
            let mut statement = connection.prepare_cached(
            "SELECT v.at_ms, g.generation, g.best, g.mean, g.min, g.standard_deviation, g.digest,
                    g.duration_ms, g.episodes, g.workers, g.idle_share
             FROM events v
             JOIN generations g
               ON g.experiment_id = v.experiment_id AND g.generation = v.generation
             WHERE v.experiment_id = ?1 AND v.sequence > ?2 AND v.generation >= ?2
                   AND v.kind = 'generation'
             ORDER BY v.sequence LIMIT ?3",
        )?;
            let from_generation = i64::try_from(from_generation).unwrap_or(i64::MAX);
            let rows = statement.query_map(params![id.0, from_generation, limit], |row| {
                let missing = || StoreError::Corrupt(format!("a generation of {id}"));
                Ok((row.get(0)?, read_generation(row, 1)?.ok_or_else(missing)))
            })?;
            rows.map(|row| {
                let (completed_at_ms, generation) = row?;
                Ok((completed_at_ms, generation?))
            })
            .collect()
        })
    }
}

/// Adds a generation to an experiment's history.
pub fn put(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    generation: &GenerationRecord,
) -> rusqlite::Result<()> {
    let statistics = &generation.statistics;
    let mut statement = transaction.prepare_cached(
        "INSERT INTO generations VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
    )?;
    statement.execute(params![
        id.0,
        generation.generation,
        statistics.best.get(),
        statistics.mean.get(),
        statistics.min.get(),
        statistics.standard_deviation.get(),
        generation.digest,
        generation.duration_ms,
        generation.episodes,
        generation.workers,
        generation.idle_share,
        sealer.generation(id, generation),
    ])?;
    Ok(())
}

/// Seals a generation that is stored.
pub fn seal(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    generation: &GenerationRecord,
) -> rusqlite::Result<()> {
    let mut statement = transaction.prepare_cached(
        "UPDATE generations SET seal = ?3 WHERE experiment_id = ?1 AND generation = ?2",
    )?;
    let seal = sealer.generation(id, generation);
    statement.execute(params![id.0, generation.generation, seal])?;
    Ok(())
}

/// An experiment's history, with its seals, in order.
pub fn read_all(
    connection: &Connection,
    id: ExperimentId,
) -> rusqlite::Result<Vec<(GenerationRecord, Vec<u8>)>> {
    read(connection, id, 0, i64::MAX.unsigned_abs())
}

/// An experiment's generations in `first..end`, in order.
pub fn read_between(
    connection: &Connection,
    id: ExperimentId,
    first: u64,
    end: u64,
) -> rusqlite::Result<Vec<GenerationRecord>> {
    let rows = read(connection, id, first, end)?;
    Ok(rows.into_iter().map(|(generation, _)| generation).collect())
}

fn read(
    connection: &Connection,
    id: ExperimentId,
    first: u64,
    end: u64,
) -> rusqlite::Result<Vec<(GenerationRecord, Vec<u8>)>> {
    let mut statement = connection.prepare_cached(
        "SELECT seal, generation, best, mean, min, standard_deviation, digest,
                duration_ms, episodes, workers, idle_share
         FROM generations
         WHERE experiment_id = ?1 AND generation >= ?2 AND generation < ?3 ORDER BY generation",
    )?;
    let read = |row: &Row<'_>| Ok((read_generation(row, 1)?, row.get(0)?));
    let rows = statement.query_map(params![id.0, first, end], read)?;
    // Without an outer join, every row has a generation.
    rows.filter_map(|row| row.map(|(generation, seal)| Some((generation?, seal))).transpose())
        .collect()
}

/// Reads the columns of `generations`, in the schema's order, from column `first` on; `None` if
/// an outer join found no row.
pub fn read_generation(row: &Row<'_>, first: usize) -> rusqlite::Result<Option<GenerationRecord>> {
    let Some(generation) = row.get(first)? else { return Ok(None) };
    Ok(Some(GenerationRecord {
        generation,
        statistics: Statistics {
            best: real(row, first + 1)?,
            mean: real(row, first + 2)?,
            min: real(row, first + 3)?,
            standard_deviation: real(row, first + 4)?,
        },
        digest: row.get(first + 5)?,
        duration_ms: row.get(first + 6)?,
        episodes: row.get(first + 7)?,
        workers: row.get(first + 8)?,
        idle_share: row.get(first + 9)?,
    }))
}

/// Reads a number. SQLite stores NaN as NULL, so the number is never NaN.
pub fn real(row: &Row<'_>, column: usize) -> rusqlite::Result<Real> {
    let number: f64 = row.get(column)?;
    Real::try_from(number).map_err(|error| {
        rusqlite::Error::FromSqlConversionFailure(column, Type::Real, Box::new(error))
    })
}

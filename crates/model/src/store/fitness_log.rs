//! The tables of the fitness log and of its keyframes.
//!
//! The log has an experiment's generations from `experiments.log_from` on, without gaps, and a
//! keyframe before the first of them. Further keyframes come in between. So every later state has
//! a checkpoint.

use bundle::Keyframes;
use evolution::{Checkpoint, FLAT_COUNTED_MAX, Told};
use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use super::{
    GenerationRecord, LogGap, history,
    seals::{Seal, Sealer},
};
use crate::ids::ExperimentId;

/// The data that a generation adds.
#[derive(Debug, Clone, Copy)]
pub struct Entry<'a> {
    /// The fitness of the generation, as bytes of [`evolution::Told::to_bytes`].
    pub told: &'a [u8],
    /// The state of evolution after it, if a keyframe is due.
    pub keyframe: Option<&'a [u8]>,
}

/// The seals of an entry, computed before the transaction.
#[derive(Debug, Clone, Copy)]
pub struct EntrySeals {
    told: Seal,
    keyframe: Option<Seal>,
}

impl Entry<'_> {
    /// Its seals. `of`: the generation.
    pub fn seals(&self, sealer: &Sealer, id: ExperimentId, of: &GenerationRecord) -> EntrySeals {
        EntrySeals {
            told: sealer.told(id, of, self.told),
            keyframe: self.keyframe.map(|state| sealer.keyframe(id, Some(of), state)),
        }
    }

    /// Adds it to the log.
    pub fn put(
        &self,
        transaction: &Transaction<'_>,
        id: ExperimentId,
        generation: u64,
        seals: EntrySeals,
    ) -> rusqlite::Result<()> {
        put_told(transaction, id, generation, self.told, seals.told)?;
        if let (Some(state), Some(seal)) = (self.keyframe, seals.keyframe) {
            put_keyframe(transaction, id, generation + 1, state, seal)?;
        }
        Ok(())
    }
}

/// Adds the fitness of a generation.
pub fn put_told(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    generation: u64,
    told: &[u8],
    seal: Seal,
) -> rusqlite::Result<()> {
    transaction
        .prepare_cached("INSERT INTO fitness_log VALUES (?1, ?2, ?3, ?4)")?
        .execute(params![id.0, generation, told, seal])?;
    Ok(())
}

/// Adds a keyframe; `n_generations`: number of generations before it.
pub fn put_keyframe(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    n_generations: u64,
    state: &[u8],
    seal: Seal,
) -> rusqlite::Result<()> {
    transaction
        .prepare_cached("INSERT INTO keyframes VALUES (?1, ?2, ?3, ?4)")?
        .execute(params![id.0, n_generations, state, seal])?;
    Ok(())
}

/// The checkpoint after this many generations; `None` if it is missing or has a broken seal.
/// `sealer`: `None` if the database has no seals yet.
pub fn checkpoint(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
    n_generations: u64,
) -> rusqlite::Result<Option<Checkpoint>> {
    let mut statement = connection.prepare_cached(
        "SELECT n_generations, state, seal FROM keyframes
         WHERE experiment_id = ?1 AND n_generations <= ?2
         ORDER BY n_generations DESC LIMIT 1",
    )?;
    let read = |row: &rusqlite::Row<'_>| {
        // Older databases store text.
        let state = row.get_ref(1)?.as_bytes()?.to_vec();
        Ok((row.get::<_, u64>(0)?, state, row.get::<_, Vec<u8>>(2)?))
    };
    let found = statement.query_row(params![id.0, n_generations], read).optional()?;
    let Some((first, keyframe, seal)) = found else { return Ok(None) };
    let history = history::read_between(connection, id, first.saturating_sub(1), n_generations)?;
    let Some((before, since)) =
        history.split_at_checked((history.len() as u64 + first - n_generations) as usize)
    else {
        return Ok(None);
    };
    let mut is_sound = before.len() as u64 == first.min(1)
        && sealer.is_none_or(|sealer| seal == sealer.keyframe(id, before.last(), &keyframe));
    let mut statement = connection.prepare_cached(
        "SELECT generation, told, seal FROM fitness_log
         WHERE experiment_id = ?1 AND generation >= ?2 AND generation < ?3 ORDER BY generation",
    )?;
    let mut rows = statement.query(params![id.0, first, n_generations])?;
    let mut log = Vec::with_capacity(since.len());
    for of in since {
        let Some(row) = rows.next()? else { return Ok(None) };
        let (generation, told): (u64, Vec<u8>) = (row.get(0)?, row.get(1)?);
        is_sound &= generation == of.generation
            && match sealer {
                Some(sealer) => row.get_ref(2)?.as_blob()? == sealer.told(id, of, &told),
                None => true,
            };
        log.push(told);
    }
    if !is_sound {
        return Ok(None);
    }
    let n_flat = n_flat_before(connection, id, first)?;
    Ok(Some(Checkpoint { keyframe, log, n_flat }))
}

/// Number of consecutive generations before generation `end` in which all individuals had equal
/// fitness, as far as the log reaches.
fn n_flat_before(connection: &Connection, id: ExperimentId, end: u64) -> rusqlite::Result<u64> {
    let mut statement = connection.prepare_cached(
        "SELECT generation, best = min, told
         FROM fitness_log JOIN generations USING (experiment_id, generation)
         WHERE experiment_id = ?1 AND generation < ?2 ORDER BY generation DESC LIMIT ?3",
    )?;
    let mut rows = statement.query(params![id.0, end, FLAT_COUNTED_MAX])?;
    let mut n_flat = 0;
    while let Some(row) = rows.next()? {
        // Statistics omit individuals without finite fitness, so the log decides.
        let is_flat = row.get::<_, u64>(0)? + n_flat + 1 == end
            && row.get(1)?
            && Told::from_bytes(row.get_ref(2)?.as_blob()?).is_ok_and(|told| told.is_flat());
        if !is_flat {
            break;
        }
        n_flat += 1;
    }
    Ok(n_flat)
}

/// Whether the log has no generation from this one on.
pub fn ends_at(connection: &Connection, id: ExperimentId, end: u64) -> rusqlite::Result<bool> {
    let sql = "SELECT NOT EXISTS (SELECT 1 FROM fitness_log
                                  WHERE experiment_id = ?1 AND generation >= ?2)
                  AND NOT EXISTS (SELECT 1 FROM keyframes
                                  WHERE experiment_id = ?1 AND n_generations > ?2)";
    connection.prepare_cached(sql)?.query_row(params![id.0, end], |row| row.get(0))
}

/// The fitness of a generation, if it is in the log with an intact seal.
pub fn told(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
    of: &GenerationRecord,
) -> rusqlite::Result<Option<Vec<u8>>> {
    let mut statement = connection.prepare_cached(
        "SELECT told, seal FROM fitness_log WHERE experiment_id = ?1 AND generation = ?2",
    )?;
    let read = |row: &rusqlite::Row<'_>| Ok((row.get::<_, Vec<u8>>(0)?, row.get::<_, Vec<u8>>(1)?));
    let found = statement.query_row(params![id.0, of.generation], read).optional()?;
    Ok(found.and_then(|(told, seal)| {
        let is_sound = sealer.is_none_or(|sealer| seal == sealer.told(id, of, &told));
        is_sound.then_some(told)
    }))
}

/// All keyframes with the number of generations before them, in order; `None` if a seal is
/// broken.
pub fn keyframes(
    connection: &Connection,
    sealer: &Sealer,
    id: ExperimentId,
    history: &[&GenerationRecord],
) -> rusqlite::Result<Option<Keyframes>> {
    let mut statement = connection.prepare_cached(
        "SELECT n_generations, state, seal FROM keyframes
         WHERE experiment_id = ?1 ORDER BY n_generations",
    )?;
    let mut rows = statement.query([id.0])?;
    let mut keyframes = Vec::new();
    while let Some(row) = rows.next()? {
        let (n_generations, seal): (u64, Vec<u8>) = (row.get(0)?, row.get(2)?);
        let state = row.get_ref(1)?.as_bytes()?.to_vec();
        let latest = n_generations.checked_sub(1).map(|last| history.get(last as usize));
        if latest == Some(None) || seal != sealer.keyframe(id, latest.flatten().copied(), &state) {
            return Ok(None);
        }
        keyframes.push((n_generations, state));
    }
    Ok(Some(keyframes))
}

/// Sets the first generation of the log, and why it is not generation 0.
pub fn begin_at(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    first: u64,
    gap: LogGap,
) -> rusqlite::Result<()> {
    let sql = "UPDATE experiments SET log_from = ?2, log_gap = ?3 WHERE id = ?1";
    transaction.execute(sql, params![id.0, first, gap.name()])?;
    Ok(())
}

/// Deletes an experiment's log and all its keyframes. Returns their size in bytes.
pub fn delete(transaction: &Transaction<'_>, id: ExperimentId) -> rusqlite::Result<u64> {
    let n_bytes = len(transaction, id)?;
    for table in ["fitness_log", "keyframes"] {
        transaction.execute(&format!("DELETE FROM {table} WHERE experiment_id = ?1"), [id.0])?;
    }
    Ok(n_bytes)
}

/// Bytes of an experiment's log and all its keyframes.
pub fn len(connection: &Connection, id: ExperimentId) -> rusqlite::Result<u64> {
    let sql = "SELECT (SELECT ifnull(sum(length(told)), 0) FROM fitness_log
                       WHERE experiment_id = ?1)
                    + (SELECT ifnull(sum(length(state)), 0) FROM keyframes
                       WHERE experiment_id = ?1)";
    connection.query_row(sql, [id.0], |row| row.get(0))
}

/// Seals an experiment's only keyframe, in a database that has no log yet. `latest`: the
/// generation before it.
pub fn seal(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    latest: Option<&GenerationRecord>,
) -> rusqlite::Result<()> {
    let read = "SELECT state FROM keyframes WHERE experiment_id = ?1";
    let state = transaction.query_row(read, [id.0], |row| row.get::<_, Vec<u8>>(0)).optional()?;
    if let Some(state) = state {
        let seal = sealer.keyframe(id, latest, &state);
        let write = "UPDATE keyframes SET seal = ?2 WHERE experiment_id = ?1";
        transaction.execute(write, params![id.0, seal])?;
    }
    Ok(())
}

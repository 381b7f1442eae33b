//! Finds the sound end of a fitness log in a database that may be damaged.

use evolution::Evolution;
use rusqlite::{Connection, Row, params};

use super::{
    super::{GenerationRecord, LogGap, fitness_log, seals::Sealer},
    experiment::{ExperimentRow, unreadable},
};
use crate::ids::ExperimentId;

/// The sound end of a fitness log, from a keyframe on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SoundLog {
    /// Number of generations before that keyframe.
    pub first: u64,
    /// Why this number is not 0.
    pub gap: LogGap,
}

/// Finds the longest sound end of a log; `None` if no keyframe is sound, not even one after the
/// latest generation. Adds the damage to `problems`.
pub fn read(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
    history: &[GenerationRecord],
    row: &ExperimentRow,
    problems: &mut Vec<String>,
) -> Option<SoundLog> {
    match find(connection, sealer, id, history) {
        Err(problem) => {
            problems.push(problem);
            None
        }
        Ok(None) if row.log_from >= history.len() as u64 && !row.is_unfinished() => None,
        Ok(None) => {
            problems.push("its keyframes are gone, or not what was stored".to_owned());
            None
        }
        Ok(Some(first)) if first > row.log_from => {
            problems.push(format!(
                "the fitness of generations {} to {}, or the keyframe before them, is not what \
                 was stored",
                row.log_from,
                first - 1
            ));
            Some(SoundLog { first, gap: LogGap::Damaged })
        }
        Ok(Some(first)) => Some(SoundLog { first, gap: row.log_gap.unwrap_or(LogGap::Damaged) }),
    }
}

/// Finds the first keyframe from which the rest of the log is sound.
fn find(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
    history: &[GenerationRecord],
) -> Result<Option<u64>, String> {
    let unreadable = unreadable("its fitness log");
    // The first generation from which all entries are sound.
    let mut sound_from = history.len() as u64;
    let mut next = None;
    each(connection, "fitness_log", "generation", "told", id, |generation, told, seal| {
        let of = history.get(generation as usize);
        let is_sound =
            of.is_some_and(|of| sealer.is_none_or(|sealer| seal == sealer.told(id, of, told)));
        if next != Some(generation) {
            sound_from = generation;
        }
        if !is_sound {
            sound_from = generation + 1;
        }
        next = Some(generation + 1);
    })
    .map_err(&unreadable)?;
    if next.is_some_and(|next| next != history.len() as u64) {
        return Err("its fitness log and its history have different generations".to_owned());
    }
    let mut first = None;
    each(connection, "keyframes", "n_generations", "state", id, |n_generations, state, seal| {
        let before = n_generations.checked_sub(1);
        let latest = before.map(|before| history.get(before as usize));
        let is_sound = latest != Some(None)
            && sealer.is_none_or(|sealer| seal == sealer.keyframe(id, latest.flatten(), state));
        if !is_sound && n_generations >= sound_from {
            // Later generations follow from the previous keyframe.
            first = None;
        } else if first.is_none() && n_generations >= sound_from {
            first = Some(n_generations);
        }
    })
    .map_err(&unreadable)?;
    Ok(first)
}

/// Reads a table of bytes and seals, in order.
fn each(
    connection: &Connection,
    table: &str,
    key: &str,
    bytes: &str,
    id: ExperimentId,
    mut visit: impl FnMut(u64, &[u8], &[u8]),
) -> rusqlite::Result<()> {
    let sql =
        format!("SELECT {key}, {bytes}, seal FROM {table} WHERE experiment_id = ?1 ORDER BY {key}");
    let mut statement = connection.prepare_cached(&sql)?;
    let mut rows = statement.query(params![id.0])?;
    while let Some(row) = rows.next()? {
        visit(row.get(0)?, bytes_of(row, 1)?, bytes_of(row, 2)?);
    }
    Ok(())
}

/// Bytes of a column, which is text in older databases.
fn bytes_of<'a>(row: &'a Row<'_>, column: usize) -> rusqlite::Result<&'a [u8]> {
    Ok(row.get_ref(column)?.as_bytes()?)
}

/// Checks that the latest checkpoint leads to the end of the history.
pub fn check_end(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
    history: &[GenerationRecord],
    row: &ExperimentRow,
) -> Result<(), String> {
    let n_generations = history.len() as u64;
    let checkpoint = fitness_log::checkpoint(connection, sealer, id, n_generations)
        .map_err(unreadable("its checkpoint"))?
        .ok_or("its checkpoint is not what was stored")?;
    let evolution = Evolution::restore(&checkpoint)
        .map_err(|error| format!("its checkpoint is not valid: {error}"))?;
    let link = row.last_link(history);
    if evolution.digest().to_string() != link {
        let found = evolution.digest();
        return Err(format!("its checkpoint has the digest {found}, and the history {link}"));
    }
    Ok(())
}

/// Copies a sound log to another database, with its seals.
pub fn copy(
    from: &Connection,
    to: &rusqlite::Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    log: SoundLog,
    history: &[GenerationRecord],
) -> rusqlite::Result<()> {
    let mut result = Ok(());
    each(from, "fitness_log", "generation", "told", id, |generation, told, _| {
        if result.is_ok()
            && generation >= log.first
            && let Some(of) = history.get(generation as usize)
        {
            let seal = sealer.told(id, of, told);
            result = fitness_log::put_told(to, id, generation, told, seal);
        }
    })?;
    each(from, "keyframes", "n_generations", "state", id, |n_generations, state, _| {
        if result.is_ok() && n_generations >= log.first {
            let before = n_generations.checked_sub(1).and_then(|index| history.get(index as usize));
            let seal = sealer.keyframe(id, before, state);
            result = fitness_log::put_keyframe(to, id, n_generations, state, seal);
        }
    })?;
    result?;
    fitness_log::begin_at(to, id, log.first, log.gap)
}

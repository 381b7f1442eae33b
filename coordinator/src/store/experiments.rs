//! Experiments as their rows have them, with their latest generation.

use rusqlite::{Connection, OptionalExtension, Row};

use crate::{group::Membership, ids::ExperimentId, priority::Priority};

use super::{
    ExperimentRecord, ExperimentState, ForkRecord, LogGap, StoreError, error::Result, history,
    labels,
};

/// One of them.
pub fn get(connection: &Connection, id: ExperimentId) -> Result<Option<ExperimentRecord>> {
    if i64::try_from(id.0).is_err() {
        return Ok(None); // SQLite's integers are signed.
    }
    let mut statement = connection.prepare_cached(&format!("{SELECT} WHERE e.id = ?1"))?;
    statement.query_row([id.0], read).optional()?.transpose()
}

/// All of them, oldest first.
pub fn all(connection: &Connection) -> Result<Vec<ExperimentRecord>> {
    let mut statement = connection.prepare_cached(&format!("{SELECT} ORDER BY e.id"))?;
    let rows = statement.query_map([], read)?;
    rows.map(|row| row?).collect()
}

const SELECT: &str =
    "SELECT e.id, e.config, e.config_digest, e.fingerprint, e.genotype_len, e.state, e.reason,
            e.submitted_at_ms, e.digest, c.held_out_mean, c.judged_mean,
            g.generation, g.best, g.mean, g.min, g.standard_deviation, g.digest,
            g.duration_ms, g.episodes, g.workers, g.idle_share, e.priority,
            (SELECT max(sequence) FROM events WHERE experiment_id = e.id),
            e.group_name, e.variant, e.log_from, e.log_gap,
            f.parent_id, f.generation, f.link, f.changes, e.labels, e.archived,
            (SELECT avg(r.duration_ms) FROM generations r
             WHERE r.experiment_id = e.id AND r.generation > g.generation - 10)
     FROM experiments e
     LEFT JOIN forks f ON f.experiment_id = e.id
     LEFT JOIN champions c ON c.experiment_id = e.id
     LEFT JOIN generations g ON g.experiment_id = e.id AND g.generation =
               (SELECT max(generation) FROM generations WHERE experiment_id = e.id)";

fn read(row: &Row<'_>) -> rusqlite::Result<Result<ExperimentRecord>> {
    let id = ExperimentId(row.get(0)?);
    let state: String = row.get(5)?;
    let Some(state) = ExperimentState::from_name(&state) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has state \"{state}\""))));
    };
    let Some(priority) = Priority::new(row.get(21)?) else {
        return Ok(Err(StoreError::Corrupt(format!("experiment {id} has no valid priority"))));
    };
    let log_gap: String = row.get(26)?;
    let Some(log_gap) = LogGap::from_name(&log_gap) else {
        let what = format!("experiment {id} has a log without \"{log_gap}\"");
        return Ok(Err(StoreError::Corrupt(what)));
    };
    Ok(Ok(ExperimentRecord {
        id,
        config_json: row.get(1)?,
        config_digest: row.get(2)?,
        fingerprint: row.get(3)?,
        genotype_len: row.get(4)?,
        state,
        reason: row.get(6)?,
        submitted_at_ms: row.get(7)?,
        digest: row.get(8)?,
        held_out_fitness: row.get(9)?,
        judged_fitness: row.get(10)?,
        latest: history::read_generation(row, 11)?,
        priority,
        last_sequence: row.get::<_, Option<u64>>(22)?.unwrap_or_default(),
        membership: membership(row.get(23)?, row.get(24)?),
        labels: labels::from_json(&row.get::<_, String>(31)?),
        is_archived: row.get(32)?,
        recent_generation_ms: row.get(33)?,
        log_from: row.get(25)?,
        log_gap,
        fork: match row.get(27)? {
            Some(parent) => Some(ForkRecord {
                parent: ExperimentId(parent),
                generation: row.get(28)?,
                link: row.get(29)?,
                changes: serde_json::from_str(row.get_ref(30)?.as_str()?).unwrap_or_default(),
            }),
            None => None,
        },
    }))
}

/// The place in a group that a row has.
fn membership(group: Option<String>, variant: Option<String>) -> Option<Membership> {
    group.map(|group| Membership { group, variant: variant.unwrap_or_default() })
}

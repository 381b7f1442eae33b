//! Reads an experiment part by part, and finds the readable parts with intact seals.

use evolution::{ALGORITHMS, Champion, Digest};
use experiment_file::ExperimentConfig;
use rusqlite::{Connection, Row};

use super::{
    super::{
        ExperimentState, ForkRecord, GenerationRecord, LogGap, StoreError, champions, forks,
        history, sealing, seals::Sealer, soundness,
    },
    log::{self, SoundLog},
    source::Source,
};
use crate::{ids::ExperimentId, restored::restore_evolution};

/// The sound parts of an experiment. A part that is `None` is damaged.
#[derive(Debug)]
pub struct Inspected {
    /// Its id.
    pub id: ExperimentId,
    /// Its row, with the configuration.
    pub row: Option<ExperimentRow>,
    /// All its generations.
    pub history: Option<Vec<GenerationRecord>>,
    /// Its champion, if it has one.
    pub champion: Option<Option<Champion>>,
    /// The sound part of its fitness log. `None` is not damage if it has ended without a log.
    pub log: Option<SoundLog>,
    /// Whether it can continue from its log.
    pub can_go_on: bool,
    /// All its events.
    pub events: Option<Vec<EventRow>>,
    /// The problems, one line each.
    pub problems: Vec<String>,
}

/// A row of the table of experiments; see the schema.
#[derive(Debug)]
pub struct ExperimentRow {
    pub request_id: Option<String>,
    pub name: String,
    pub config: String,
    pub config_digest: String,
    pub fingerprint: String,
    pub genotype_len: u64,
    /// `None` if the state is unknown.
    pub state: Option<ExperimentState>,
    pub reason: String,
    pub submitted_at_ms: u64,
    pub digest: String,
    pub priority: i64,
    pub group: Option<String>,
    pub variant: Option<String>,
    pub labels: String,
    pub is_archived: bool,
    pub log_from: u64,
    /// `None` if the reason is unknown.
    pub log_gap: Option<LogGap>,
    /// Its origin, if it is a fork.
    pub fork: Option<ForkRecord>,
}

impl ExperimentRow {
    /// The last link of the digest chain after `history`.
    pub fn last_link<'a>(&'a self, history: &'a [GenerationRecord]) -> &'a str {
        match (history.last(), &self.fork) {
            (Some(latest), Some(fork)) if latest.generation == fork.generation => &fork.link,
            (Some(latest), _) => &latest.digest,
            (None, _) => &self.config_digest,
        }
    }

    /// Whether it has not ended.
    pub fn is_unfinished(&self) -> bool {
        self.state.is_some_and(ExperimentState::is_unfinished)
    }
}

/// A row of the table of events; see the schema.
#[derive(Debug)]
pub struct EventRow {
    pub sequence: u64,
    pub at_ms: u64,
    pub kind: String,
    pub generation: Option<u64>,
    pub state: Option<String>,
    pub message: Option<String>,
}

/// The result of a recovery for an experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// Everything on which its bits and its results depend is kept.
    Kept,
    /// Only its configuration is kept: it can be recomputed, to the same bits.
    Restarted,
    /// Nothing is kept.
    Lost,
}

impl Fate {
    /// The next step after damage. `restore`: the step that always helps.
    pub fn next_step(self, restore: &str) -> String {
        let outcome = match self {
            Self::Kept => "that keeps the rest of the experiment",
            Self::Restarted => "that recomputes the experiment, to the same bits",
            Self::Lost => "that loses the experiment: submit it again",
        };
        format!("{restore}; {outcome}")
    }
}

impl Inspected {
    /// Reads an experiment.
    pub fn read(source: &Source, id: ExperimentId) -> Self {
        let Source { connection, sealer, .. } = source;
        let sealer = sealer.as_ref();
        let mut problems = Vec::new();
        let row = keep(&mut problems, read_row(connection, sealer, id));
        let history = keep(&mut problems, read_history(connection, sealer, id));
        let champion = keep(&mut problems, read_champion(connection, sealer, id));
        let mut log = None;
        let mut can_go_on = false;
        if let (Some(row), Some(history)) = (&row, &history) {
            log = log::read(connection, sealer, id, history, row, &mut problems);
            // Another version of the simulation may know other algorithms.
            can_go_on = log.is_some()
                && (row.fingerprint != sim_core::FINGERPRINT
                    || keep(&mut problems, log::check_end(connection, sealer, id, history, row))
                        .is_some());
        }
        let events = keep(&mut problems, read_events(connection, id, history.as_deref()));
        // Adds the coordinator's own verdict. The coordinator continues an ended experiment only on
        // request.
        let is_unfinished = row.as_ref().is_some_and(ExperimentRow::is_unfinished);
        if let (true, true, Some(sealer)) = (is_unfinished, can_go_on, sealer) {
            can_go_on = keep(&mut problems, check_resumable(connection, sealer, id)).is_some();
        }
        let mut inspected = Self { id, row, history, champion, log, can_go_on, events, problems };
        inspected.find_what_is_missing();
        inspected
    }

    /// The result of a recovery for it.
    pub fn fate(&self) -> Fate {
        let Some(row) = &self.row else { return Fate::Lost };
        let has_all = match row.state {
            None => false,
            // The next generation restores the champion.
            Some(state) if state.is_unfinished() => self.can_go_on,
            Some(_) => self.history.is_some() && self.champion.is_some(),
        };
        match has_all {
            true => Fate::Kept,
            // A fork needs the state of another experiment.
            false if row.fingerprint == sim_core::FINGERPRINT && row.fork.is_none() => {
                Fate::Restarted
            }
            false => Fate::Lost,
        }
    }

    fn find_what_is_missing(&mut self) {
        let Some(row) = &self.row else { return };
        if row.state.is_none() {
            self.problems.push("its state is unknown".to_owned());
        }
        let has_ended = row.state.is_some_and(|state| !state.is_unfinished());
        let n_shared = row.fork.as_ref().map_or(0, |fork| fork.generation + 1);
        let n_generations = self.history.as_ref().map_or(0, |history| history.len() as u64);
        let has_history = n_generations > n_shared;
        if has_ended && has_history && matches!(self.champion, Some(None)) {
            self.champion = None;
            self.problems.push("its champion is gone".to_owned());
        }
    }
}

/// The checks of a coordinator before an experiment continues.
fn check_resumable(
    connection: &Connection,
    sealer: &Sealer,
    id: ExperimentId,
) -> Result<(), String> {
    let resumable = soundness::resumable(connection, sealer, id);
    let (experiment, checkpoint) = resumable.map_err(|error| error.to_string())??;
    // With another version of the simulation, the experiment only waits.
    if experiment.fingerprint == sim_core::FINGERPRINT {
        restore_evolution(&experiment, &checkpoint)?;
    }
    Ok(())
}

/// Returns a part, or adds its problem and returns `None`.
fn keep<T>(problems: &mut Vec<String>, part: Result<T, String>) -> Option<T> {
    part.map_err(|problem| problems.push(problem)).ok()
}

/// The problem of an unreadable part.
pub fn unreadable(what: &str) -> impl Fn(rusqlite::Error) -> String {
    move |error| format!("{what} cannot be read: {error}")
}

fn read_row(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
) -> Result<ExperimentRow, String> {
    let unreadable = unreadable("its configuration");
    let from_row = |row: &Row<'_>| {
        Ok(ExperimentRow {
            request_id: row.get(0)?,
            name: row.get(1)?,
            config: row.get(2)?,
            config_digest: row.get(3)?,
            fingerprint: row.get(4)?,
            genotype_len: row.get(5)?,
            state: ExperimentState::from_name(&row.get::<_, String>(6)?),
            reason: row.get(7)?,
            submitted_at_ms: row.get(8)?,
            digest: row.get(9)?,
            priority: row.get::<_, i64>(10)?.clamp(1, 1000),
            group: row.get(11)?,
            variant: row.get(12)?,
            log_from: row.get(13)?,
            log_gap: LogGap::from_name(&row.get::<_, String>(14)?),
            labels: row.get(15)?,
            is_archived: row.get(16)?,
            fork: None,
        })
    };
    let sql =
        "SELECT request_id, name, (SELECT config FROM configs WHERE experiment_id = id) AS config,
                      config_digest, fingerprint, genotype_len, state, reason, submitted_at_ms,
                      digest, priority, group_name, variant, log_from, log_gap, labels, archived
               FROM experiments WHERE id = ?1";
    let row = connection.query_row(sql, [id.0], from_row).map_err(&unreadable)?;
    let fork = forks::get(connection, sealer, id).map_err(|error| error.to_string())?;
    let row = ExperimentRow { fork, ..row };
    if let Some(sealer) = sealer {
        let (seal, expected) =
            sealing::experiment_seal(connection, sealer, id).map_err(&unreadable)?;
        if seal != expected {
            return Err("its configuration is not what was stored".to_owned());
        }
    }
    // Another version of the simulation may accept other files.
    if row.fingerprint == sim_core::FINGERPRINT {
        let (config, _) = ExperimentConfig::from_json(&row.config, "", ALGORITHMS)
            .map_err(|error| format!("its configuration is not valid: {error}"))?;
        let digest = Digest::of_config(&config, &row.fingerprint).to_string();
        if digest != row.config_digest {
            return Err(format!(
                "its configuration has the digest {digest}, and not {}",
                row.config_digest
            ));
        }
    }
    Ok(row)
}

fn read_history(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
) -> Result<Vec<GenerationRecord>, String> {
    let rows = history::read_all(connection, id).map_err(unreadable("its history"))?;
    let mut history = Vec::with_capacity(rows.len());
    for (number, (generation, seal)) in (0..).zip(rows) {
        if generation.generation != number {
            return Err(format!("generation {number} is gone from its history"));
        }
        if sealer.is_some_and(|sealer| seal != sealer.generation(id, &generation)) {
            return Err(format!("generation {number} of its history is not what was stored"));
        }
        history.push(generation);
    }
    Ok(history)
}

fn read_champion(
    connection: &Connection,
    sealer: Option<&Sealer>,
    id: ExperimentId,
) -> Result<Option<Champion>, String> {
    champions::get(connection, sealer, id).map_err(|error| match error {
        StoreError::Corrupt(what) => format!("its champion cannot be used: {what}"),
        error => format!("its champion cannot be read: {error}"),
    })
}

/// Events have no seals, because no result depends on them.
fn read_events(
    connection: &Connection,
    id: ExperimentId,
    history: Option<&[GenerationRecord]>,
) -> Result<Vec<EventRow>, String> {
    let unreadable = unreadable("its events");
    let mut statement = connection
        .prepare_cached(
            "SELECT sequence, at_ms, kind, generation, state, message FROM events
             WHERE experiment_id = ?1 ORDER BY sequence",
        )
        .map_err(&unreadable)?;
    let from_row = |row: &Row<'_>| {
        Ok(EventRow {
            sequence: row.get(0)?,
            at_ms: row.get(1)?,
            kind: row.get(2)?,
            generation: row.get(3)?,
            state: row.get(4)?,
            message: row.get(5)?,
        })
    };
    let rows = statement.query_map([id.0], from_row).map_err(&unreadable)?;
    let events: Vec<EventRow> = rows.collect::<rusqlite::Result<_>>().map_err(&unreadable)?;
    let are_whole = (1..).zip(&events).all(|(sequence, event)| event.sequence == sequence);
    if !are_whole || events.is_empty() {
        return Err("some of its events are gone".to_owned());
    }
    let generations = events.iter().filter_map(|event| event.generation);
    match history {
        Some(history) if !generations.eq(0..history.len() as u64) => {
            Err("its events and its history have different generations".to_owned())
        }
        _ => Ok(events),
    }
}

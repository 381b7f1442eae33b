//! Exports and imports ended experiments with everything from which their results follow.

use bundle::Bundle;
use evolution::Champion;
use rusqlite::{OptionalExtension, Transaction, params};

use super::{
    Evidence, ExperimentRecord, ExperimentState, ForkRecord, GenerationRecord, LogGap, Result,
    Store, StoreError, add_notice, add_state_event, champions, configs, fitness_log, forks,
    history, seals::Sealer,
};
use crate::{ids::ExperimentId, priority::Priority};

/// An experiment of a verified bundle.
#[derive(Debug)]
pub struct Imported {
    /// The bundle.
    pub bundle: Bundle,
    /// Name for display.
    pub name: String,
    /// Number of genes of a genotype.
    pub genotype_len: usize,
    /// How it ended.
    pub state: ExperimentState,
    /// Its champion.
    pub champion: Option<Champion>,
    /// Its origin, if it is a fork.
    pub fork: Option<ForkRecord>,
}

impl Store {
    /// Everything from which an experiment's results follow; a broken seal is damage.
    pub fn evidence(&self, experiment: &ExperimentRecord) -> Result<Evidence> {
        let id = experiment.id;
        let history = self.generations(id, 0, u32::MAX)?;
        let champion = self.champion(id)?;
        self.read(|connection| {
            let sealer = Some(&self.sealer);
            let damaged = || StoreError::Corrupt(format!("the fitness log of experiment {id}"));
            let mut log = Vec::new();
            for (_, of) in history.iter().skip(experiment.log_from as usize) {
                log.push(fitness_log::told(connection, sealer, id, of)?.ok_or_else(damaged)?);
            }
            let rows: Vec<&GenerationRecord> = history.iter().map(|(_, row)| row).collect();
            let keyframes = fitness_log::keyframes(connection, &self.sealer, id, &rows)?;
            let keyframes = keyframes.ok_or_else(damaged)?;
            Ok(Evidence { history: history.clone(), log, keyframes, champion })
        })
    }

    /// Adds an ended experiment, or returns the existing one with the same bits.
    pub fn import(&mut self, imported: &Imported, now_ms: u64) -> Result<(ExperimentId, bool)> {
        if let Some(id) = self.same_as(&imported.bundle)? {
            return Ok((id, false));
        }
        self.write(|transaction, sealer| {
            let id = put_row(transaction, sealer, imported)?;
            put_evidence(transaction, sealer, id, imported)?;
            put_events(transaction, id, imported, now_ms)?;
            Ok((id, true))
        })
    }

    /// The experiment of a bundle, if the database has it.
    fn same_as(&self, bundle: &Bundle) -> Result<Option<ExperimentId>> {
        let manifest = &bundle.manifest;
        let (config_digest, digest) =
            (manifest.config_digest.to_string(), manifest.digest.to_string());
        self.read(|connection| {
            let mut statement = connection.prepare_cached(
                "SELECT id FROM experiments
                 WHERE config_digest = ?1 AND digest = ?2
                       AND (SELECT config FROM configs WHERE experiment_id = id) = ?3
                 ORDER BY id",
            )?;
            let id = statement
                .query_row(params![config_digest, digest, bundle.config_json], |row| {
                    row.get(0).map(ExperimentId)
                });
            Ok(id.optional()?)
        })
    }

    /// The experiment that has this link after a generation.
    pub fn experiment_with_link(
        &self,
        generation: u64,
        link: &str,
    ) -> Result<Option<ExperimentId>> {
        self.read(|connection| {
            let mut statement = connection.prepare_cached(
                "SELECT min(experiment_id) FROM generations WHERE generation = ?1 AND digest = ?2",
            )?;
            let id = statement.query_row(params![generation, link], |row| row.get(0));
            Ok(id.map(|id: Option<u64>| id.map(ExperimentId))?)
        })
    }
}

fn put_row(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    imported: &Imported,
) -> Result<ExperimentId> {
    let Imported { bundle, name, genotype_len, state, .. } = imported;
    let manifest = &bundle.manifest;
    transaction.execute(
        "INSERT INTO experiments (name, config_digest, fingerprint, genotype_len, state, reason,
                                  submitted_at_ms, digest, priority)
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        params![
            name,
            manifest.config_digest.to_string(),
            manifest.simulation,
            genotype_len,
            state.name(),
            manifest.reason,
            manifest.submitted_at_ms,
            manifest.digest.to_string(),
            Priority::default().weight(),
        ],
    )?;
    let id = ExperimentId(transaction.last_insert_rowid().unsigned_abs());
    configs::put(transaction, sealer, id, &bundle.config_json)?;
    Ok(id)
}

fn put_evidence(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    imported: &Imported,
) -> Result<()> {
    let Imported { bundle, champion, fork, .. } = imported;
    let first = bundle.first_own();
    if let Some(fork) = fork {
        forks::put(transaction, sealer, id, fork)?;
        fitness_log::begin_at(transaction, id, first, LogGap::Forked)?;
    }
    let history: Vec<GenerationRecord> = bundle.history.iter().map(Into::into).collect();
    for row in &history {
        history::put(transaction, sealer, id, row)?;
    }
    for (told, of) in bundle.log.iter().zip(history.iter().skip(first as usize)) {
        let seal = sealer.told(id, of, told);
        fitness_log::put_told(transaction, id, of.generation, told, seal)?;
    }
    for (n_generations, state) in &bundle.keyframes {
        let before = n_generations.checked_sub(1).and_then(|last| history.get(last as usize));
        let seal = sealer.keyframe(id, before, state);
        fitness_log::put_keyframe(transaction, id, *n_generations, state, seal)?;
    }
    if let Some(champion) = champion {
        let latest = history.last().map(|latest| latest.generation);
        let digest = bundle.manifest.digest.to_string();
        champions::put(transaction, sealer, id, champion, latest, &digest)?;
    }
    Ok(())
}

fn put_events(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    imported: &Imported,
    now_ms: u64,
) -> Result<()> {
    let Imported { bundle, state, .. } = imported;
    let manifest = &bundle.manifest;
    let submitted = manifest.submitted_at_ms;
    add_state_event(transaction, id, submitted, ExperimentState::Running, "submitted")?;
    let mut statement = transaction.prepare_cached(
        "INSERT INTO events (experiment_id, sequence, at_ms, kind, generation)
         VALUES (?1, ?2, ?3, 'generation', ?4)",
    )?;
    for row in &bundle.history {
        let generation = row.generation;
        statement.execute(params![id.0, generation + 2, row.completed_at_ms, generation])?;
    }
    let ended = bundle.history.last().map_or(submitted, |latest| latest.completed_at_ms);
    add_state_event(transaction, id, ended, *state, &manifest.reason)?;
    add_notice(transaction, id, now_ms, "imported from a bundle")?;
    Ok(())
}

impl From<&bundle::GenerationRow> for GenerationRecord {
    fn from(row: &bundle::GenerationRow) -> Self {
        Self {
            generation: row.generation,
            statistics: row.statistics(),
            digest: row.digest.to_string(),
            duration_ms: row.duration_ms,
            episodes: row.episodes,
            workers: row.workers,
            idle_share: row.idle_share,
        }
    }
}

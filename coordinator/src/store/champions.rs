//! The table of champions.

use rusqlite::{Connection, OptionalExtension as _, Transaction, params};

use crate::ids::ExperimentId;
use evolution::{Champion, ChampionSource, HeldOut};

use super::StoreError;

/// Replaces an experiment's champion.
pub fn put(
    transaction: &Transaction<'_>,
    id: ExperimentId,
    champion: &Champion,
) -> rusqlite::Result<()> {
    let individual = match champion.source {
        ChampionSource::Individual(individual) => Some(individual),
        ChampionSource::Mean => None,
    };
    transaction.execute(
        "INSERT OR REPLACE INTO champions VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
        params![
            id.0,
            champion.generation,
            individual,
            to_json(&champion.trial_fitness),
            to_json(&champion.genotype),
            champion.held_out.map(|held_out| held_out.mean),
            champion.held_out.map(|held_out| held_out.ci95),
            champion.held_out.map(|held_out| held_out.n_trials),
            champion.held_out.map(|held_out| held_out.generation),
        ],
    )?;
    Ok(())
}

/// Reads an experiment's champion.
pub fn get(connection: &Connection, id: ExperimentId) -> Result<Option<Champion>, StoreError> {
    let mut statement = connection.prepare_cached(
        "SELECT generation, individual, trial_fitness, genotype,
                held_out_mean, held_out_ci95, held_out_trials, held_out_generation
         FROM champions WHERE experiment_id = ?1",
    )?;
    let row = statement
        .query_row([id.0], |row| {
            let individual: Option<u32> = row.get(1)?;
            let held_out = match row.get(4)? {
                Some(mean) => Some(HeldOut {
                    mean,
                    ci95: row.get(5)?,
                    n_trials: row.get(6)?,
                    generation: row.get(7)?,
                }),
                None => None,
            };
            let champion = Champion {
                generation: row.get(0)?,
                source: individual.map_or(ChampionSource::Mean, ChampionSource::Individual),
                genotype: Vec::new(),
                trial_fitness: Vec::new(),
                held_out,
            };
            Ok((champion, row.get::<_, String>(2)?, row.get::<_, String>(3)?))
        })
        .optional()?;
    let Some((champion, trial_fitness, genotype)) = row else { return Ok(None) };
    let list = |text: &str| {
        serde_json::from_str(text)
            .map_err(|error| StoreError::Corrupt(format!("champion of {id}: {error}")))
    };
    let (trial_fitness, genotype) = (list(&trial_fitness)?, list(&genotype)?);
    Ok(Some(Champion { trial_fitness, genotype, ..champion }))
}

/// Mean of a stored list; none if it is empty or damaged.
pub fn mean(list: &str) -> Option<f64> {
    let values: Vec<f64> = serde_json::from_str(list).ok()?;
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn to_json(values: &[f64]) -> String {
    serde_json::to_string(values).expect("numbers serialise")
}

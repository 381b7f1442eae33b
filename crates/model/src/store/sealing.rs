//! Seals stored rows: those of an experiment, or all rows of a database that has no seals yet.

use rusqlite::{Connection, Transaction, params};

use super::{
    Result, champions, fitness_log, history,
    seals::{Seal, Sealer},
};
use crate::ids::ExperimentId;

/// Seals a stored experiment.
pub fn seal_experiment(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
) -> rusqlite::Result<()> {
    let seal = experiment_seal(transaction, sealer, id)?.1;
    transaction.execute("UPDATE experiments SET seal = ?2 WHERE id = ?1", params![id.0, seal])?;
    Ok(())
}

/// The seal that an experiment has, and the one that it should have.
pub fn experiment_seal(
    connection: &Connection,
    sealer: &Sealer,
    id: ExperimentId,
) -> rusqlite::Result<(Vec<u8>, Seal)> {
    let mut statement = connection.prepare_cached(
        "SELECT seal, (SELECT config FROM configs WHERE experiment_id = id), config_digest,
                fingerprint, genotype_len
         FROM experiments WHERE id = ?1",
    )?;
    statement.query_row([id.0], |row| {
        let config = row.get_ref(1)?.as_bytes()?;
        let (digest, fingerprint): (String, String) = (row.get(2)?, row.get(3)?);
        let seal = sealer.experiment(id, config, &digest, &fingerprint, row.get(4)?);
        Ok((row.get(0)?, seal))
    })
}

/// Seals all rows of a database that has no seals yet.
pub fn seal_all(transaction: &Transaction<'_>) -> Result<()> {
    let sealer = Sealer::from_database(transaction)?;
    let mut statement = transaction.prepare("SELECT id FROM experiments")?;
    let ids = statement.query_map([], |row| row.get(0).map(ExperimentId))?;
    for id in ids {
        let id = id?;
        seal_experiment(transaction, &sealer, id)?;
        let history = history::read_all(transaction, id)?;
        for (generation, _) in &history {
            history::seal(transaction, &sealer, id, generation)?;
        }
        let latest = history.last().map(|(generation, _)| generation);
        fitness_log::seal(transaction, &sealer, id, latest)?;
        champions::seal(transaction, &sealer, id)?;
    }
    Ok(())
}

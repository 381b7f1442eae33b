//! The table of experiment files, apart from the rows of experiments: lists need no files.

use rusqlite::{Transaction, params};

use super::{schema::summary, sealing, seals::Sealer};
use crate::ids::ExperimentId;

/// Puts the file of an experiment, in canonical form, beside its row, and seals the row. The row
/// gets a summary of the file.
pub fn put(
    transaction: &Transaction<'_>,
    sealer: &Sealer,
    id: ExperimentId,
    config: &str,
) -> rusqlite::Result<()> {
    transaction
        .prepare_cached("INSERT OR REPLACE INTO configs VALUES (?1, ?2)")?
        .execute(params![id.0, config])?;
    let sql = concat!(
        "UPDATE experiments SET summary = (SELECT ",
        summary!(),
        " FROM configs WHERE experiment_id = id) WHERE id = ?1"
    );
    transaction.prepare_cached(sql)?.execute([id.0])?;
    sealing::seal_experiment(transaction, sealer, id)
}

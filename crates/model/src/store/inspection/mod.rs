//! Inspects a database that may be damaged, and recovers its sound parts into new data
//! directories. Never writes to the database.

mod backup;
mod experiment;
mod log;
mod recovery;
mod source;

use std::path::{Path, PathBuf};

use crate::ids::ExperimentId;

use super::error::Result;

pub use backup::{Backup, backup};
pub use experiment::Fate;
pub use recovery::{Recovered, Recovery, recover};

use experiment::Inspected;
use source::Source;

/// The result of an inspection.
#[derive(Debug)]
pub struct Inspection {
    /// The database.
    pub path: PathBuf,
    /// Version of its schema.
    pub schema_version: i64,
    /// Number of experiments.
    pub n_experiments: usize,
    /// Number of readable generations with intact seals.
    pub n_generations: usize,
    /// The problems.
    pub findings: Vec<Finding>,
}

/// A problem of a database.
#[derive(Debug)]
pub struct Finding {
    /// The experiment, if the problem concerns one.
    pub experiment: Option<ExperimentId>,
    /// The problem, in one line.
    pub what: String,
    /// The next step, in one line.
    pub next_step: String,
}

/// Inspects the whole database of a data directory, whether or not a coordinator uses it.
pub fn inspect(directory: &Path) -> Result<Inspection> {
    let path = super::file::path_in(directory);
    let restore = format!(
        "restore a backup, or keep what is sound: \
         `swarmctl doctor --data-dir {} --recover NEW`",
        directory.display()
    );
    inspect_file(&path, &restore)
}

/// Inspects a database. `restore`: the next step for damage that does not concern an experiment.
fn inspect_file(path: &Path, restore: &str) -> Result<Inspection> {
    let mut findings = Vec::new();
    let general = |what: String| Finding { experiment: None, what, next_step: restore.to_owned() };
    let source = Source::open(path)?;
    findings.extend(source.damage.iter().cloned().map(general));
    let mut n_generations = 0;
    let ids = source.experiments();
    for &id in &ids {
        let inspected = Inspected::read(&source, id);
        n_generations += inspected.history.as_ref().map_or(0, Vec::len);
        let next_step = inspected.fate().next_step(restore);
        findings.extend(inspected.problems.into_iter().map(|problem| Finding {
            experiment: Some(id),
            what: format!("experiment {id}: {problem}"),
            next_step: next_step.clone(),
        }));
    }
    Ok(Inspection {
        path: path.to_owned(),
        schema_version: source.version,
        n_experiments: ids.len(),
        n_generations,
        findings,
    })
}

#[cfg(test)]
pub mod tests;

//! Looks at a database that may be damaged, and makes new data directories of what is
//! sound in it. Never writes to it.

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

/// What a database is like.
#[derive(Debug)]
pub struct Inspection {
    /// The database.
    pub path: PathBuf,
    /// Version of its schema.
    pub schema_version: i64,
    /// Experiments in it.
    pub n_experiments: usize,
    /// Generations that can be read and are as they were stored.
    pub n_generations: usize,
    /// What is wrong.
    pub findings: Vec<Finding>,
}

/// Something that is wrong with a database.
#[derive(Debug)]
pub struct Finding {
    /// The experiment that it is about, if it is about one.
    pub experiment: Option<ExperimentId>,
    /// What is wrong, in one line.
    pub what: String,
    /// What can be done, in one line.
    pub next_step: String,
}

/// Looks at everything in the database of a data directory, whether or not a
/// coordinator uses it.
pub fn inspect(directory: &Path) -> Result<Inspection> {
    let path = super::file::path_in(directory);
    let restore = format!(
        "restore a backup, or keep what is sound: \
         `swarmctl doctor --data-dir {} --recover NEW`",
        directory.display()
    );
    inspect_file(&path, &restore)
}

/// Looks at a database. `restore`: what to do about damage that is not an experiment's.
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
#[cfg(test)]
mod verdicts;

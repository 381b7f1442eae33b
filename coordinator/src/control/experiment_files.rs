//! A cache of checked experiment files: a client that runs its own evolution sends the same file
//! with every generation.

use std::{
    num::NonZeroUsize,
    sync::{Arc, Mutex},
};

use evolution::ALGORITHMS;
use experiment_file::{ConfigError, ExperimentConfig};
use lru::LruCache;
use sim_core::Simulation;

/// Number of files in the cache. A large one takes tens of megabytes.
const REMEMBERED: NonZeroUsize = NonZeroUsize::new(4).expect("it is not 0");

/// A file that has passed all checks.
#[derive(Debug)]
pub struct CheckedFile {
    /// The experiment's name.
    pub name: Arc<str>,
    /// Its canonical form.
    pub spec: Arc<str>,
    /// The simulation that it describes.
    pub simulation: Simulation,
}

/// The latest files, by their text.
#[derive(Debug)]
pub struct ExperimentFiles(Mutex<LruCache<String, Arc<CheckedFile>>>);

impl Default for ExperimentFiles {
    fn default() -> Self {
        Self(Mutex::new(LruCache::new(REMEMBERED)))
    }
}

impl ExperimentFiles {
    /// Checks a file completely, unless the cache has it; CPU-bound.
    pub fn check(&self, config_json: &str) -> Result<Arc<CheckedFile>, ConfigError> {
        let latest = || self.0.lock().expect("nothing panics while it holds the files");
        if let Some(known) = latest().get(config_json) {
            return Ok(Arc::clone(known));
        }
        let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)?;
        let checked = Arc::new(CheckedFile {
            name: config.name.as_str().into(),
            spec: config.to_canonical_json().into(),
            simulation: Simulation::compile(&config)?,
        });
        latest().put(config_json.to_owned(), Arc::clone(&checked));
        Ok(checked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_checked_once_and_a_wrong_one_every_time() {
        let files = ExperimentFiles::default();
        let quickstart = include_str!("../../../configs/quickstart.json");
        let first = files.check(quickstart).unwrap();
        assert!(Arc::ptr_eq(&first, &files.check(quickstart).unwrap()));
        assert!(files.check("{}").is_err());
        assert!(files.check("{}").is_err());
        for n in 0..REMEMBERED.get() {
            files.check(&format!("{quickstart}{}", " ".repeat(n + 1))).unwrap();
        }
        let again = files.check(quickstart).unwrap();
        assert!(!Arc::ptr_eq(&first, &again), "the oldest is forgotten");
        assert_eq!(first.spec, again.spec);
    }
}

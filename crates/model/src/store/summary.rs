//! Some keys of an experiment file. The database stores them beside the file, so that a list of
//! ten thousand experiments parses no files.

use experiment_file::ExperimentConfig;
use serde::Deserialize;

/// Keys of an experiment file. Keys that an older file lacks are 0 or empty.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(from = "Row")]
pub struct Summary {
    /// `seed`.
    pub seed: u64,
    /// `algorithm.generations`.
    pub generations: u64,
    /// `algorithm.name`.
    pub algorithm: String,
    /// `algorithm.population_size`.
    pub population_size: u64,
    /// `algorithm.num_evaluations`.
    pub num_evaluations: u64,
    /// `algorithm.champion_trials`.
    pub champion_trials: u64,
    /// `algorithm.judgement_trials`.
    pub judgement_trials: u64,
    /// Bytes of the file in canonical form.
    pub config_len: u64,
}

/// The column `summary`.
type Row = (
    Option<u64>,
    Option<u64>,
    Option<String>,
    Option<u64>,
    Option<u64>,
    Option<u64>,
    Option<u64>,
    u64,
);

impl From<Row> for Summary {
    fn from(row: Row) -> Self {
        Self {
            seed: row.0.unwrap_or_default(),
            generations: row.1.unwrap_or_default(),
            algorithm: row.2.unwrap_or_default(),
            population_size: row.3.unwrap_or_default(),
            num_evaluations: row.4.unwrap_or_default(),
            champion_trials: row.5.unwrap_or_default(),
            judgement_trials: row.6.unwrap_or_default(),
            config_len: row.7,
        }
    }
}

impl Summary {
    /// Reads the column `summary`, which is NULL if the file is not JSON.
    pub fn from_column(json: Option<&str>) -> Self {
        json.and_then(|json| serde_json::from_str(json).ok()).unwrap_or_default()
    }

    /// The summary of a configuration. `config_json`: its canonical form.
    pub fn from_config(config: &ExperimentConfig, config_json: &str) -> Self {
        let algorithm = &config.algorithm;
        Self {
            seed: config.seed,
            generations: algorithm.generations,
            algorithm: algorithm.name.clone(),
            population_size: algorithm.population_size.into(),
            num_evaluations: algorithm.num_evaluations.into(),
            champion_trials: algorithm.champion_trials.into(),
            judgement_trials: algorithm.judgement_trials.into(),
            config_len: config_json.len() as u64,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{store::Store, submission::Submission};

    use super::*;

    #[test]
    fn the_database_and_the_file_agree_to_the_last_digit_of_a_seed() {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let config_json = include_str!("../../../../configs/quickstart.json").to_owned();
        for seed in [7, (1 << 53) + 1, u64::MAX] {
            let config_json = config_json.clone();
            let submission = Submission { config_json, seed: Some(seed), ..Submission::default() };
            let new = submission.check(&|| true).unwrap().new;
            let (id, _) = store.create(&new, 0).unwrap();
            let stored = store.experiment(id).unwrap().unwrap();
            assert_eq!(stored.summary, Summary::from_config(&new.config, &stored.config_json));
            assert_eq!((stored.summary.seed, &stored.name), (seed, &new.config.name));
        }
    }

    #[test]
    fn an_invalid_summary_is_empty() {
        for text in [None, Some(""), Some("[]"), Some("[1, \"\"]"), Some("[-1, 2, 3]")] {
            assert_eq!(Summary::from_column(text), Summary::default());
        }
    }
}

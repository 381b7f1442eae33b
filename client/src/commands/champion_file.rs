//! Writes the champion of an experiment that `run` has computed to a file in the data
//! directory.

use std::path::{Path, PathBuf};

use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::individual::champion_document;
use crate::{error::Error, json, output_file::Overwrite};

/// Longest part of an experiment's name in a file's name, in characters.
const FILE_NAME_CHARS_MAX: usize = 50;

/// Writes the champion to a file in the data directory; returns its path. Replaces an earlier
/// champion file of the same experiment.
pub fn write(
    data_dir: &Path,
    experiment: &Experiment,
    champion: &GetChampionResponse,
) -> Result<PathBuf, Error> {
    let path = data_dir.join(champion_file_name(experiment));
    let document = json::document(&champion_document(experiment, champion)?) + "\n";
    Overwrite::OWN.write(&path, document.as_bytes())?;
    Ok(path)
}

/// `NAME-ID.champion.json`, without characters that could lead outside the directory.
fn champion_file_name(experiment: &Experiment) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let name: String = experiment
        .name
        .chars()
        .take(FILE_NAME_CHARS_MAX)
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect();
    format!("{name}-{}.champion.json", experiment.id)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn experiment(id: u64, name: &str) -> Experiment {
        Experiment { id, name: name.into(), ..Experiment::default() }
    }

    #[test]
    fn names_of_experiments_make_harmless_names_of_files() {
        let file_name = |name| champion_file_name(&experiment(3, name));
        assert_eq!(file_name("leader"), "leader-3.champion.json");
        assert_eq!(file_name("../a b/c"), ".._a_b_c-3.champion.json");
        assert_eq!(file_name("größe"), "größe-3.champion.json");
        // File systems allow 255 bytes.
        assert!(file_name(&"𐐀".repeat(1000)).len() <= 255);
    }

    #[test]
    fn a_stored_champion_equals_the_printed_one() {
        let dir = tempfile::tempdir().unwrap();
        let champion = GetChampionResponse {
            experiment_id: 3,
            genotype: vec![0.1],
            network_json: "{}".into(),
            ..GetChampionResponse::default()
        };
        let experiment = experiment(3, "a");
        let path = write(dir.path(), &experiment, &champion).unwrap();
        let stored = fs::read_to_string(path).unwrap();
        let printed = json::document(&champion_document(&experiment, &champion).unwrap());
        assert_eq!(stored, printed + "\n");
    }
}

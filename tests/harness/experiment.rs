//! Experiment files for tests, made from the shipped ones.

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::{Value, json};
use tempfile::TempDir;

/// A file of the workspace, by its path from the root.
pub fn workspace_file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// An experiment file in a directory of its own.
#[derive(Debug)]
pub struct Experiment {
    directory: TempDir,
    value: Value,
}

impl Experiment {
    /// The thesis's leader selection, reduced so that a genotype takes some milliseconds, and a
    /// generation about a tenth of a second.
    pub fn small(generations: u64) -> Self {
        let text = fs::read_to_string(workspace_file("configs/leader_selection_snes.json"))
            .expect("shipped with the project");
        let mut value: Value = serde_json::from_str(&text).expect("valid JSON");
        value["seed"] = json!(7);
        let algorithm = &mut value["algorithm"];
        algorithm["generations"] = json!(generations);
        algorithm["population_size"] = json!(12);
        algorithm["evaluation_steps"] = json!(300);
        algorithm["num_evaluations"] = json!(3);
        algorithm["champion_trials"] = json!(3);
        algorithm["judgement_trials"] = json!(3);
        Self::from_value(value)
    }

    /// An even smaller one: a generation takes some hundredths of a second.
    pub fn tiny(generations: u64) -> Self {
        Self::small(generations).edit(|value| {
            let algorithm = &mut value["algorithm"];
            algorithm["population_size"] = json!(10);
            algorithm["evaluation_steps"] = json!(250);
            algorithm["num_evaluations"] = json!(2);
        })
    }

    /// A file of any content.
    pub fn from_value(value: Value) -> Self {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let experiment = Self { directory, value };
        experiment.save();
        experiment
    }

    /// Changes the file.
    pub fn edit(mut self, edit: impl FnOnce(&mut Value)) -> Self {
        edit(&mut self.value);
        self.save();
        self
    }

    /// The file.
    pub fn path(&self) -> PathBuf {
        self.directory.path().join("experiment.json")
    }

    /// Its text.
    pub fn text(&self) -> String {
        self.value.to_string()
    }

    fn save(&self) {
        fs::write(self.path(), self.text()).expect("the temporary directory is writable");
    }
}

//! Checks that a genotype evolved under the experiment file that it is used with.

use evolution::Digest;
use experiment_file::Seed;
use serde::Deserialize;
use serde_json::Value;
use swarm_proto::v1::Experiment;

use crate::{
    args::ChangedArg,
    error::{Code, Error},
    experiment_file::{ExperimentFile, Overrides},
};

/// Characters of a digest that messages show.
const SHOWN: usize = 12;

/// The experiment in which a genotype evolved.
#[derive(Debug, PartialEq, Eq, Deserialize)]
pub struct Origin {
    config_digest: String,
    #[serde(default)]
    name: String,
    seed: Option<Seed>,
    simulation: Option<String>,
}

impl Origin {
    /// The experiment that a file with a genotype states; none if it states none, like a
    /// list of genes.
    pub fn of_file(file: &Value) -> Result<Option<Self>, serde_json::Error> {
        match file.get("config_digest") {
            None | Some(Value::Null) => Ok(None),
            Some(_) => Self::deserialize(file).map(Some),
        }
    }

    /// The experiment of a coordinator's genotypes; none if the coordinator does not
    /// state it.
    pub fn of_experiment(experiment: &Experiment) -> Option<Self> {
        let Experiment { config_digest, name, seed, simulation, .. } = experiment.clone();
        let simulation = Some(simulation).filter(|simulation| !simulation.is_empty());
        let origin = Self { config_digest, name, seed: Some(Seed(seed)), simulation };
        Some(origin).filter(|origin| !origin.config_digest.is_empty())
    }

    /// Refuses an experiment file if the genotype evolved under another one, whatever the seed,
    /// unless `--changed-conditions` is given. `genotype`: the source of the genotype.
    pub fn check(
        &self,
        genotype: &str,
        file: &ExperimentFile,
        ChangedArg { changed_conditions }: ChangedArg,
    ) -> Result<(), Error> {
        if changed_conditions {
            return Ok(());
        }
        let seed = self.seed.map(|Seed(seed)| seed);
        let compiled = file.compile(&Overrides { seed, ..Overrides::default() });
        let config = compiled.map_err(|error| file.invalid(&error))?.config;
        let simulation = self.simulation.as_deref().unwrap_or(sim_core::FINGERPRINT);
        if Digest::of_config(&config, simulation).to_string() == self.config_digest {
            return Ok(());
        }
        let seed = seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
        let digest: String = self.config_digest.chars().take(SHOWN).collect();
        let message = format!(
            "{genotype}: it evolved in `{}`{seed}, configuration {digest}, and {} is another \
             experiment; give the original file, or --changed-conditions to accept this one",
            self.name.escape_debug(),
            file.path().display()
        );
        Err(Error::at(Code::OtherExperiment, genotype, message))
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    use serde_json::json;

    use super::*;
    use crate::experiment_file::tests::{quickstart, shipped};

    const KNOWINGLY: ChangedArg = ChangedArg { changed_conditions: true };

    /// A champion of the quickstart with this seed.
    fn champion(seed: u64) -> Value {
        let file = ExperimentFile::read(&quickstart()).unwrap();
        let overrides = Overrides { seed: Some(seed), ..Overrides::default() };
        let config = file.compile(&overrides).unwrap().config;
        json!({
            "name": "quickstart",
            "seed": Seed(seed),
            "simulation": "another simulation",
            "config_digest": Digest::of_config(&config, "another simulation").to_string(),
            "genotype": [0.5],
        })
    }

    fn check(champion: &Value, file: &Path, changed: ChangedArg) -> Result<(), String> {
        let origin = Origin::of_file(champion).unwrap().unwrap();
        let file = ExperimentFile::read(file).unwrap();
        origin.check("c.json", &file, changed).map_err(|error| error.to_string())
    }

    #[test]
    fn a_champion_is_accepted_with_its_own_file_whatever_the_seed() {
        for seed in [0, 7, u64::MAX] {
            check(&champion(seed), &quickstart(), ChangedArg::default()).unwrap();
        }
    }

    #[test]
    fn a_champion_is_refused_with_another_file_unless_an_option_allows_it() {
        let directory = tempfile::tempdir().unwrap();
        let longer = directory.path().join("longer.json");
        let text = fs::read_to_string(quickstart()).unwrap();
        let steps = "\"evaluation_steps\": 100";
        assert!(text.contains(steps));
        fs::write(&longer, text.replace(steps, "\"evaluation_steps\": 99")).unwrap();
        let champion = champion(7);
        for file in [&longer, &shipped("leader_selection_snes")] {
            let error = check(&champion, file, ChangedArg::default()).unwrap_err();
            let digest = &champion["config_digest"].as_str().unwrap()[..12];
            let name = file.display().to_string();
            for part in ["c.json", "`quickstart`, seed 7", digest, &name, "--changed-conditions"] {
                assert!(error.contains(part), "{error}");
            }
            assert_eq!(error.lines().count(), 1, "{error}");
            check(&champion, file, KNOWINGLY).unwrap();
        }
    }

    #[test]
    fn a_list_of_genes_names_no_experiment() {
        for genes in [json!([0.5]), json!({"genotype": [0.5]}), json!({"config_digest": null})] {
            assert_eq!(Origin::of_file(&genes).unwrap(), None);
        }
        assert!(Origin::of_file(&json!({"config_digest": 3})).is_err());
    }
}

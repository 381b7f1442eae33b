//! The genotype to simulate: from a file, from a coordinator, or random.

use std::{fmt, path::Path};

use determinism::random::{Purpose, Stream};
use model::Address;
use serde_json::Value;

use super::{SimulateArgs, champion::Origin};
use crate::{
    args::ChangedArg,
    connection::Connection,
    error::{Code, Error},
    experiment_file::{Compiled, ExperimentFile},
    file_kind::{self, Kind},
    genotypes::{Found, described},
    input::{GENOTYPE_BYTES, read_text},
    place::Intent,
    progress::Progress,
    settings::Settings,
};

/// Before the path of a file with a genotype.
const IN_FILE: &str = "genotype in ";

/// Genes and their source, which is also their display.
#[derive(Debug)]
pub struct Genotype {
    pub genes: Vec<f64>,
    /// The source of the genes, for people: "champion of experiment 3".
    source: String,
}

impl Genotype {
    /// The genotype in a file, for use with an experiment file. Refuses a champion of
    /// another experiment, unless `--changed-conditions` is given.
    pub fn read(path: &Path, file: &ExperimentFile, changed: ChangedArg) -> Result<Self, Error> {
        let (genes, origin) = read(path).map_err(|problem| {
            let path = path.display();
            Error::at(Code::UnreadableFile, &path, format!("no genotype in {path}: {problem}"))
        })?;
        if let Some(origin) = origin {
            origin.check(&path.display().to_string(), file, changed)?;
        }
        Ok(Self { genes, source: format!("{IN_FILE}{}", path.display()) })
    }

    /// The genotype at an address.
    pub fn found(address: Address, found: Found) -> Self {
        Self { genes: found.individual.genotype, source: described(address) }
    }

    /// The genotype for an experiment file, not yet checked against it.
    pub async fn choose(
        settings: Settings,
        args: &SimulateArgs,
        file: &ExperimentFile,
        compiled: &Compiled,
        progress: &Progress,
    ) -> Result<Self, Error> {
        if let Some(path) = &args.genotype {
            return Self::read(path, file, args.changed);
        }
        if let Some(address) = &args.experiment {
            let connection = Connection::open(settings, Intent::Read, progress).await?;
            let address = connection.resolve(address).await?;
            let found = connection.genotype(address).await?;
            if let Some(origin) = Origin::of_experiment(&found.experiment) {
                origin.check(&described(address), file, args.changed)?;
            }
            return Ok(Self::found(address, found));
        }
        Ok(Self { genes: random(compiled), source: "random genotype".into() })
    }
}

impl Genotype {
    /// The file, or else the source.
    pub fn place(&self) -> &str {
        self.source.strip_prefix(IN_FILE).unwrap_or(&self.source)
    }
}

impl fmt::Display for Genotype {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.source)
    }
}

/// Reads a list of genes, or the list in an object together with its experiment.
fn read(path: &Path) -> Result<(Vec<f64>, Option<Origin>), String> {
    file_kind::expect(path, &[Kind::Champion, Kind::Genes], "a file with a genotype")?;
    let text = read_text(path, GENOTYPE_BYTES).map_err(|error| error.to_string())?;
    let value: Value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    let genes = match &value {
        Value::Array(genes) => Some(genes),
        object => object["genotype"].as_array(),
    };
    let genes = genes.ok_or("expected a list of numbers, or an object with a list `genotype`")?;
    let gene = |(index, gene): (usize, &Value)| {
        gene.as_f64().ok_or_else(|| format!("gene {index} is not a number"))
    };
    let genes: Vec<f64> = genes.iter().enumerate().map(gene).collect::<Result<_, _>>()?;
    let origin = Origin::of_file(&value).map_err(|error| error.to_string())?;
    Ok((genes, origin))
}

/// Uniform genes from the streams of the first generation of a population.
fn random(compiled: &Compiled) -> Vec<f64> {
    let segments = compiled.experiment.population_segments().iter().zip(0..);
    let genes = segments.flat_map(|(segment, population)| {
        let mut stream = Stream::new(compiled.config.seed, 0, 0, Purpose::Evolution, population);
        segment.clone().map(move |_| stream.uniform())
    });
    genes.collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use evolution::Evolution;

    use super::*;
    use crate::experiment_file::{Overrides, tests::shipped};

    #[test]
    fn a_random_genotype_is_the_first_that_a_ga_evaluates() {
        let file = ExperimentFile::read(&shipped("leader_selection_ga")).unwrap();
        let compiled = file.compile(&Overrides { seed: Some(7), ..Overrides::default() }).unwrap();
        let segments = compiled.experiment.population_segments();
        let evolution = Evolution::new(&compiled.config, segments, sim_core::FINGERPRINT);
        assert_eq!(random(&compiled), evolution.ask().genotypes[0][..]);
    }

    #[test]
    fn genes_stand_alone_or_in_an_object() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("genes.json");
        for text in ["[0, 0.1, 1.0]", r#"{"fitness": 3, "genotype": [0, 0.1, 1]}"#] {
            fs::write(&path, text).unwrap();
            assert_eq!(read(&path).unwrap().0, [0.0, 0.1, 1.0]);
        }
    }

    #[test]
    fn a_file_that_is_larger_than_any_champion_is_not_read_to_its_end() {
        let problem = read(Path::new("/dev/zero")).unwrap_err();
        assert_eq!(problem, format!("it has more than {} KiB", GENOTYPE_BYTES / 1024));
    }

    #[test]
    fn a_file_without_a_list_of_numbers_is_refused_in_one_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("genes.json");
        for text in ["", "[0.1", "3", "{}", r#"{"genotype": 3}"#, r#"[0.1, "0.2"]"#, "[null]"] {
            fs::write(&path, text).unwrap();
            assert_eq!(read(&path).unwrap_err().lines().count(), 1, "{text}");
        }
        assert!(read(&dir.path().join("missing")).unwrap_err().contains("No such file"));
    }
}

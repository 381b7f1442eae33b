//! The genotype that a command shows or exports: at an address, or in a file beside its experiment
//! file.

use std::path::{Path, PathBuf};

use clap::Args;
use clap_complete::ArgValueCompleter;
use swarm_proto::v1::JudgedFitness;

use super::simulate::genotype::Genotype;
use crate::{
    address::NamedAddress,
    args::{ChangedArg, FOREIGN},
    complete,
    connection::Connection,
    error::Error,
    experiment_file::ExperimentFile,
    place::Intent,
    progress::Progress,
    settings::Settings,
};

/// Arguments that name a genotype.
#[derive(Debug, Args)]
pub struct GenotypeArgs {
    /// The genotype: ID or NAME, the champion of an experiment; ID@G/I, individual I of generation
    /// G; ID@G/mean, the mean of the distribution after it; 'ID@G/cell(A,B)', the elite of a cell.
    #[arg(add = ArgValueCompleter::new(complete::experiments), required_unless_present = "config", conflicts_with_all = ["config", "genotype"])]
    pub address: Option<NamedAddress>,
    /// Experiment file of --genotype, instead of an address.
    #[arg(long, value_name = "FILE", requires = "genotype")]
    config: Option<PathBuf>,
    /// File with the genotype: a JSON list of genes, or an object with a `genotype`,
    /// such as a champion file; with --config.
    #[arg(long, value_name = "FILE", group = FOREIGN, requires = "config")]
    genotype: Option<PathBuf>,
    #[command(flatten)]
    changed: ChangedArg,
}

/// A genotype with its experiment.
pub struct Found {
    pub file: ExperimentFile,
    pub genotype: Genotype,
    /// Its generation; 0 for a file.
    pub generation: u64,
    /// Its worth, if it is a champion that was judged.
    pub judged: Option<JudgedFitness>,
}

impl GenotypeArgs {
    /// Reads the files, or asks for the genotype at the address.
    pub async fn find(&self, settings: Settings, progress: &Progress) -> Result<Found, Error> {
        if let (Some(config), Some(genotype)) = (&self.config, &self.genotype) {
            let file = ExperimentFile::read(config)?;
            let genotype = Genotype::read(genotype, &file, self.changed)?;
            return Ok(Found { file, genotype, generation: 0, judged: None });
        }
        let address = self.address.as_ref().expect("clap requires an address or a file");
        let connection = Connection::open(settings, Intent::Read, progress).await?;
        let address = connection.resolve(address).await?;
        let found = connection.genotype(address).await?;
        let name = format!("experiment {}", address.experiment);
        let file = ExperimentFile::new(name.into(), found.config_json.clone());
        let generation = found.individual.generation;
        let judged = found.individual.judged.filter(|judged| judged.trials > 0);
        Ok(Found { file, genotype: Genotype::found(address, found), generation, judged })
    }

    /// The source of the genotype, for readers of a file that the command writes. Leaves out the
    /// directories of a path, which only this machine has.
    pub fn title(&self, genotype: &Genotype) -> String {
        match self.genotype.as_deref().and_then(Path::file_name) {
            Some(name) => format!("genotype in {}", name.display()),
            None => genotype.to_string(),
        }
    }
}

//! Where experiments are read: from a coordinator, or from a data directory without one.

use std::path::{Path, PathBuf};

use coordinator::{Address, Offline, Who};
use swarm_proto::v1::{
    CompletedGeneration, Experiment, GetChampionResponse, GetExperimentRequest,
    GetIndividualsRequest, GetIndividualsResponse, GetLineageRequest, GetLineageResponse,
    ListGenerationsRequest,
};
use tonic::Status;

use crate::{
    address::NamedAddress,
    args::Subject,
    connection::{Connection, named, one, present},
    error::Error,
    settings::Settings,
};

/// Where experiments are read.
#[derive(Debug)]
pub enum Archive {
    Coordinator(Box<Connection>),
    Directory { path: PathBuf, offline: Box<Offline> },
}

/// A genotype, and what it was evolved with.
#[derive(Debug)]
pub struct Found {
    /// The file of its experiment in canonical form.
    pub config_json: String,
    pub individual: GetChampionResponse,
}

impl Archive {
    /// The data directory if one is given, else the coordinator of the settings.
    pub fn open(settings: Settings, data_dir: Option<&Path>) -> Result<Self, Error> {
        let Some(path) = data_dir else {
            return Ok(Self::Coordinator(Box::new(Connection::open(settings)?)));
        };
        let offline = Box::new(Offline::open(path).map_err(|error| Error::from_store(&error))?);
        Ok(Self::Directory { path: path.into(), offline })
    }

    /// One experiment, and its file in canonical form.
    pub async fn experiment(&self, experiment_id: u64) -> Result<(Experiment, String), Error> {
        let request = GetExperimentRequest { experiment_id };
        let response = match self {
            Self::Coordinator(connection) => {
                connection.call(async |client| client.get_experiment(request).await).await?
            }
            Self::Directory { path, offline } => {
                offline.experiment(request).map_err(|status| refused(&status, path))?
            }
        };
        Ok((present(response.experiment)?, response.config_json))
    }

    /// Those at an address; of a whole generation, some from an index on.
    pub async fn individuals(
        &self,
        address: Address,
        from_individual: u32,
    ) -> Result<GetIndividualsResponse, Error> {
        let address = address.to_string();
        let request = GetIndividualsRequest { address, from_individual, page_size: 0 };
        match self {
            Self::Coordinator(connection) => {
                connection.call(async |client| client.get_individuals(request.clone()).await).await
            }
            Self::Directory { path, offline } => {
                offline.individuals(&request).map_err(|status| refused(&status, path))
            }
        }
    }

    /// The lineage of an individual.
    pub async fn lineage(&self, address: Address, depth: u32) -> Result<GetLineageResponse, Error> {
        let request = GetLineageRequest { address: address.to_string(), depth };
        match self {
            Self::Coordinator(connection) => {
                connection.call(async |client| client.get_lineage(request.clone()).await).await
            }
            Self::Directory { path, offline } => {
                offline.lineage(&request).map_err(|status| refused(&status, path))
            }
        }
    }

    /// All completed generations.
    pub async fn generations(&self, experiment_id: u64) -> Result<Vec<CompletedGeneration>, Error> {
        let (path, offline) = match self {
            Self::Coordinator(connection) => return connection.generations(experiment_id).await,
            Self::Directory { path, offline } => (path, offline),
        };
        let mut generations = Vec::new();
        let mut next = Some(0);
        while let Some(from_generation) = next {
            let request = ListGenerationsRequest { experiment_id, from_generation, page_size: 0 };
            let page = offline.generations(request).map_err(|status| refused(&status, path))?;
            generations.extend(page.generations);
            next = page.next_generation;
        }
        Ok(generations)
    }

    /// An ended experiment as a bundle.
    pub async fn bundle(&self, experiment_id: u64) -> Result<Vec<u8>, Error> {
        match self {
            Self::Coordinator(connection) => connection.export(experiment_id).await,
            Self::Directory { path, offline } => {
                offline.bundle(experiment_id).map_err(|status| refused(&status, path))
            }
        }
    }

    /// The number of the one experiment of a number or a name.
    pub async fn experiment_id(&self, subject: &Subject) -> Result<u64, Error> {
        Ok(match (subject, self) {
            (Subject::Experiment(id), _) => *id,
            (subject, Self::Coordinator(connection)) => connection.one(subject).await?.id,
            (Subject::Group(name), Self::Directory { path, offline }) => {
                let all = offline.experiments().map_err(|status| refused(&status, path))?;
                one(name, named(name, &all)?)?.id
            }
        })
    }

    /// An address whose experiment has its number.
    pub async fn resolve(&self, address: &NamedAddress) -> Result<Address, Error> {
        Ok(address.of(self.experiment_id(&address.experiment).await?))
    }

    /// The one at an address, and its experiment.
    pub async fn one(&self, address: Address) -> Result<Found, Error> {
        if let Who::Generation(_) = address.who {
            return Err(Error::Input(format!(
                "`{address}` is a whole generation; name one of it, such as {address}/0"
            )));
        }
        let (_, config_json) = self.experiment(address.experiment.0).await?;
        let answer = self.individuals(address, 0).await?;
        let individual = present(answer.individuals.into_iter().next())?;
        Ok(Found { config_json, individual })
    }
}

/// The error of a database in which something is not found, or cannot be read.
fn refused(status: &Status, path: &Path) -> Error {
    match status.code() {
        tonic::Code::DataLoss => Error::Damaged(status.message().into()),
        tonic::Code::ResourceExhausted => Error::Input(status.message().into()),
        _ => Error::from_status(status, &path.display().to_string()),
    }
}

/// "champion of experiment 3", "individual 7 of generation 5 of experiment 3".
pub fn described(address: Address) -> String {
    let id = address.experiment;
    match address.who {
        Who::Champion => format!("champion of experiment {id}"),
        Who::Generation(generation) => format!("generation {generation} of experiment {id}"),
        Who::Individual(generation, individual) => {
            format!("individual {individual} of generation {generation} of experiment {id}")
        }
        Who::Mean(generation) => {
            format!("mean of the distribution after generation {generation} of experiment {id}")
        }
    }
}

//! Genotypes of a place, by their addresses.

use model::{Address, Who};
use swarm_proto::v1::{
    Experiment, GetChampionResponse, GetExperimentRequest, GetFrontRequest, GetFrontResponse,
    GetIndividualsRequest, GetIndividualsResponse, GetLineageRequest, GetLineageResponse,
    GetRepertoireRequest, GetRepertoireResponse,
};

use crate::{
    address::NamedAddress,
    connection::{Connection, present},
    error::{Code, Error},
    subject::Subject,
};

/// A genotype, and the experiment in which it evolved.
#[derive(Debug)]
pub struct Found {
    pub experiment: Experiment,
    /// The file of its experiment in canonical form.
    pub config_json: String,
    pub individual: GetChampionResponse,
}

impl Connection {
    /// One experiment, and its file in canonical form.
    pub async fn stored(&self, experiment_id: u64) -> Result<(Experiment, String), Error> {
        let request = GetExperimentRequest { experiment_id };
        let response = self.call(async |client| client.get_experiment(request).await).await;
        let response = response.map_err(|error| error.about(experiment_id))?;
        Ok((present(response.experiment)?, response.config_json))
    }

    /// The genotypes at an address; for a whole generation, a page from an index on.
    pub async fn individuals(
        &self,
        address: Address,
        from_individual: u32,
    ) -> Result<GetIndividualsResponse, Error> {
        let request = GetIndividualsRequest {
            address: address.to_string(),
            from_individual,
            ..GetIndividualsRequest::default()
        };
        let answer = self.call(async |client| client.get_individuals(request.clone()).await).await;
        answer.map_err(|error| error.about(address))
    }

    /// The lineage of an individual.
    pub async fn lineage(&self, address: Address, depth: u32) -> Result<GetLineageResponse, Error> {
        let request = GetLineageRequest { address: address.to_string(), depth };
        let answer = self.call(async |client| client.get_lineage(request.clone()).await).await;
        answer.map_err(|error| error.about(address))
    }

    /// The front after a generation, by default the latest one. `reference`: the point up to which
    /// volume counts; empty: the coordinator chooses it.
    pub async fn front(
        &self,
        experiment_id: u64,
        generation: Option<u64>,
        reference: Vec<f64>,
    ) -> Result<GetFrontResponse, Error> {
        let request = GetFrontRequest { experiment_id, generation, reference };
        self.call(async |client| client.get_front(request.clone()).await).await
    }

    /// The repertoire after a generation, by default the latest one.
    pub async fn repertoire(
        &self,
        experiment_id: u64,
        generation: Option<u64>,
    ) -> Result<GetRepertoireResponse, Error> {
        let request = GetRepertoireRequest { experiment_id, generation };
        self.call(async |client| client.get_repertoire(request).await).await
    }

    /// An address with the number of its experiment.
    pub async fn resolve(&self, address: &NamedAddress) -> Result<Address, Error> {
        Ok(address.in_experiment(match &address.experiment {
            Subject::Experiment(id) => *id,
            subject => self.one(subject).await?.id,
        }))
    }

    /// The genotype at an address, and its experiment.
    pub async fn genotype(&self, address: Address) -> Result<Found, Error> {
        if let Who::Generation(_) = address.who {
            let message = format!(
                "`{address}` is a whole generation; name one individual, such as {address}/0"
            );
            return Err(Error::at(Code::BadArgument, address, message));
        }
        let (mut experiment, mut config_json) = self.stored(address.experiment.0).await?;
        let answer = self.individuals(address, 0).await?;
        let individual = present(answer.individuals.into_iter().next())?;
        if let Who::Cell(..) = address.who {
            // The elite of a fork may have been born in the parent.
            (experiment, config_json) = self.stored(individual.experiment_id).await?;
        }
        Ok(Found { experiment, config_json, individual })
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
        Who::Cell(generation, cell) => {
            format!("elite of {cell} after generation {generation} of experiment {id}")
        }
    }
}

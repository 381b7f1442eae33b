//! Reads genotypes: champions, and all other individuals, recomputed from the fitness log.

use evolution::{ALGORITHMS, Champion, ChampionSource, Genotype};
use experiment_file::ExperimentConfig;
use sim_core::Simulation;
use swarm_proto::v1::{
    GetChampionRequest, GetChampionResponse, GetIndividualsRequest, GetIndividualsResponse,
};
use tonic::Status;

use crate::{
    Address, Who,
    limits::{INDIVIDUALS_LEN_MAX, PAGE_LEN_MAX},
    store::{Store, StoredExperiment},
    wire,
};

use super::{
    QueryError, Reader, StoredGeneration, address, experiment, generation::RepeatedGeneration,
};

impl Reader {
    /// The champion of an experiment.
    pub async fn get_champion(
        &self,
        request: GetChampionRequest,
    ) -> Result<GetChampionResponse, Status> {
        self.individual(&request.experiment_id.to_string()).await
    }

    /// The genotype at an address that names a single one.
    pub async fn individual(&self, address: &str) -> Result<GetChampionResponse, Status> {
        let request =
            GetIndividualsRequest { address: address.into(), ..GetIndividualsRequest::default() };
        let found = self.get_individuals(request).await?.individuals.pop();
        found.ok_or_else(|| Status::invalid_argument(format!("`{address}` names no genotype")))
    }

    /// Genotypes, recomputed if necessary.
    pub async fn get_individuals(
        &self,
        request: GetIndividualsRequest,
    ) -> Result<GetIndividualsResponse, Status> {
        let GetIndividualsRequest { address: text, from_individual, page_size, fitness_only } =
            request;
        let address = self.resolve(address(&text)?).await?;
        let page = Several { first: from_individual, len: page_size, fitness_only };
        let read = move |store: &_| StoredIndividuals::read(store, address, page);
        self.reconstruct(read, StoredIndividuals::reconstruct).await
    }
}

/// The stored data of genotypes.
#[derive(Debug)]
enum StoredIndividuals {
    /// A champion.
    Champion(StoredExperiment, Champion),
    /// Individuals of a generation.
    OfGeneration(StoredGeneration, Wanted),
}

/// A page of the individuals of a generation.
#[derive(Debug, Clone, Copy)]
struct Several {
    /// Index of the first individual.
    first: u32,
    /// Most individuals; 0: as many as possible.
    len: u32,
    /// Whether their genotypes stay empty.
    fitness_only: bool,
}

/// The requested genotypes of a generation.
#[derive(Debug, Clone, Copy)]
enum Wanted {
    /// A page of all individuals.
    Page(Several),
    /// The individual of this index.
    Individual(u32),
    /// The mean of the distribution after the generation.
    Mean,
}

impl StoredIndividuals {
    /// Reads the data of the genotypes at an address; for a whole generation, a page.
    fn read(store: &Store, address: Address, page: Several) -> Result<Self, QueryError> {
        let id = address.experiment;
        let (generation, wanted) = match address.who {
            Who::Champion => {
                let experiment = experiment(store, id)?;
                let champion = store.champion(id)?.ok_or(QueryError::NoChampion(id))?;
                return Ok(Self::Champion(experiment, champion));
            }
            Who::Generation(generation) => (generation, Wanted::Page(page)),
            Who::Individual(generation, individual) => (generation, Wanted::Individual(individual)),
            Who::Mean(generation) => (generation, Wanted::Mean),
            Who::Cell(generation, cell) => {
                return Err(QueryError::EmptyCell { experiment: id, generation, cell });
            }
        };
        Ok(Self::OfGeneration(StoredGeneration::read(store, id, generation)?, wanted))
    }

    /// Recomputes the generation, and decodes a single genotype unless another version of the
    /// simulation computed the experiment; CPU-bound.
    fn reconstruct(self) -> Result<GetIndividualsResponse, QueryError> {
        let (experiment, individuals, next_individual, is_single) = match self {
            Self::Champion(experiment, champion) => (experiment, vec![champion], None, true),
            Self::OfGeneration(stored, wanted) => {
                let (individuals, next) = individuals(&stored, wanted)?;
                let is_single = !matches!(wanted, Wanted::Page(_));
                (stored.experiment, individuals, next, is_single)
            }
        };
        let network_json = match &individuals[..] {
            [only] if is_single && experiment.fingerprint == sim_core::FINGERPRINT => {
                let network = network_json(&experiment.config_json, &only.genotype);
                network.map_err(QueryError::Undecodable)?
            }
            _ => String::new(),
        };
        let id = experiment.id.0;
        let individual = |champion| wire::individual(id, champion, network_json.clone());
        let individuals = individuals.into_iter().map(individual).collect();
        Ok(GetIndividualsResponse { individuals, next_individual })
    }
}

/// Recomputes a generation, and selects some of its genotypes.
fn individuals(
    stored: &StoredGeneration,
    wanted: Wanted,
) -> Result<(Vec<Champion>, Option<u32>), QueryError> {
    let StoredGeneration { experiment, of, .. } = stored;
    let (genotypes, told, after) = match wanted {
        Wanted::Page(Several { fitness_only: true, .. }) => (None, stored.told()?, None),
        _ => {
            let RepeatedGeneration { generation, told, after } = stored.repeat()?;
            (Some(generation.genotypes), told, Some(after))
        }
    };
    let n_individuals = told.trial_fitness.len() as u32;
    let individual = |i: u32| Champion {
        generation: of.generation,
        source: ChampionSource::Individual(i),
        genotype: genotypes.as_ref().map_or_else(Genotype::new, |all| all[i as usize].clone()),
        trial_fitness: told.trial_fitness[i as usize].clone(),
        held_out: None,
        judged: None,
    };
    let no_individual = |individual| QueryError::NoIndividual {
        experiment: experiment.id,
        generation: of.generation,
        individual,
        n_individuals,
    };
    Ok(match wanted {
        Wanted::Individual(i) if i >= n_individuals => return Err(no_individual(i)),
        Wanted::Individual(i) => (vec![individual(i)], None),
        Wanted::Page(Several { first, .. }) if first >= n_individuals => {
            return Err(no_individual(first));
        }
        Wanted::Page(Several { first, len, .. }) => {
            let n_genes = genotypes.as_ref().map_or(0, |all| all[0].len());
            let numbers_per_individual = (n_genes + told.trial_fitness[0].len()).max(1);
            let fit = INDIVIDUALS_LEN_MAX / (numbers_per_individual * size_of::<f64>());
            let len = if len == 0 { PAGE_LEN_MAX } else { len.min(PAGE_LEN_MAX) };
            let end = n_individuals.min(first.saturating_add(len.min(fit.max(1) as u32)));
            ((first..end).map(individual).collect(), (end < n_individuals).then_some(end))
        }
        Wanted::Mean => {
            let genotype = after
                .and_then(|after| after.mean())
                .ok_or(QueryError::NoMean { experiment: experiment.id })?;
            let mean = Champion {
                generation: of.generation,
                source: ChampionSource::Mean,
                genotype,
                trial_fitness: Vec::new(),
                held_out: None,
                judged: None,
            };
            (vec![mean], None)
        }
    })
}

fn network_json(config_json: &str, genotype: &[f64]) -> Result<String, String> {
    let (config, _) = ExperimentConfig::from_json(config_json, "", ALGORITHMS)
        .map_err(|error| error.to_string())?;
    let simulation = Simulation::compile(&config).map_err(|error| error.to_string())?;
    let network = simulation.network_json(genotype).map_err(|error| error.to_string())?;
    Ok(network.to_string())
}

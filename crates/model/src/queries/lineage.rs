//! Finds the ancestors of an individual by repeating its generations.

use evolution::{Ancestor, Checkpoint, Evolution, Operator, Pedigree, Told};
use experiment_file::ExperimentConfig;
use swarm_proto::v1::{
    self, BirthOperator, GenesOfParent, GetLineageRequest, GetLineageResponse, PopulationLineage,
};
use tonic::Status;

use crate::{
    Address, Who,
    limits::{ANCESTORS_MAX, LINEAGE_GENES_MAX},
    store::{LogEntry, Store, StoredExperiment},
};

use super::{
    QueryError, Reader, address, config, experiment, generation::check_in_log, other_bits,
};

impl Reader {
    /// The lineage of an individual.
    pub async fn get_lineage(
        &self,
        request: GetLineageRequest,
    ) -> Result<GetLineageResponse, Status> {
        let address = self.resolve(address(&request.address)?).await?;
        let depth = request.depth;
        let read = move |store: &_| StoredLineage::read(store, address, depth);
        self.reconstruct(read, StoredLineage::trace).await
    }
}

/// The stored data from which a lineage is computed.
#[derive(Debug)]
struct StoredLineage {
    experiment: StoredExperiment,
    individual: u32,
    /// The checkpoint before the earliest generation.
    checkpoint: Checkpoint,
    first: u64,
    /// The log from the earliest generation to that of the individual.
    log: Vec<LogEntry>,
}

impl StoredLineage {
    /// Reads the data of an individual's lineage. `depth`: number of generations before its own.
    fn read(store: &Store, address: Address, depth: u32) -> Result<Self, QueryError> {
        let id = address.experiment;
        let Who::Individual(generation, individual) = address.who else {
            return Err(QueryError::NoLineage(format!(
                "`{address}` is not an individual; name one, such as {id}@0/0"
            )));
        };
        let experiment = experiment(store, id)?;
        check_in_log(store, &experiment, generation)?;
        let first = generation.saturating_sub(depth.into()).max(experiment.log_from);
        let damaged = || QueryError::DamagedLog { experiment: id, generation };
        let (checkpoint, ..) = store.generation_in_log(id, first)?.ok_or_else(damaged)?;
        let log = store.log_between(id, first, generation + 1)?.ok_or_else(damaged)?;
        Ok(Self { experiment, individual, checkpoint, first, log })
    }

    /// Repeats the generations; CPU-bound. Each population has its own lineage; later generations
    /// come first.
    fn trace(self) -> Result<GetLineageResponse, QueryError> {
        let Self { experiment, individual, checkpoint, first, log } = self;
        let (id, generation) = (experiment.id, first + log.len() as u64 - 1);
        let other = |what: String| other_bits(&experiment, generation, what);
        let config = config(&experiment, generation)?;
        let size = u64::from(config.algorithm.population_size);
        if size * experiment.genotype_len * log.len() as u64 > LINEAGE_GENES_MAX {
            return Err(too_deep());
        }
        let names: Vec<String> = config.algorithm.populations.keys().cloned().collect();
        let mut pedigrees = vec![Pedigree::starting_at(first); names.len()];
        let mut evolution =
            Evolution::restore(&checkpoint).map_err(|error| other(error.to_string()))?;
        for (of, entry) in &log {
            let births = evolution.births().ok_or_else(|| no_parents(&experiment, &config))?;
            let told = Told::from_bytes(entry).map_err(|error| other(error.to_string()))?;
            let n_individuals = told.trial_fitness.len() as u32;
            if of.generation == generation && individual >= n_individuals {
                let experiment = id;
                return Err(QueryError::NoIndividual {
                    experiment,
                    generation,
                    individual,
                    n_individuals,
                });
            }
            for (pedigree, births) in pedigrees.iter_mut().zip(births) {
                pedigree.push(births, &told);
            }
            let repeated = evolution.repeat(&told).map_err(|error| other(error.to_string()))?;
            let found = repeated.summary.digest.to_string();
            if found != of.digest {
                return Err(other(format!("it has the digest {found}, and not {}", of.digest)));
            }
        }
        let traced =
            names.into_iter().zip(pedigrees.iter().map(|pedigree| pedigree.trace(individual)));
        let populations: Vec<(String, Vec<Ancestor>)> = traced.collect();
        if populations.iter().map(|(_, ancestors)| ancestors.len()).sum::<usize>() > ANCESTORS_MAX {
            return Err(too_deep());
        }
        let lineage = |(population, ancestors): (String, Vec<Ancestor>)| PopulationLineage {
            population,
            ancestors: ancestors.into_iter().map(ancestor).collect(),
        };
        Ok(GetLineageResponse { populations: populations.into_iter().map(lineage).collect() })
    }
}

fn ancestor(ancestor: Ancestor) -> v1::Ancestor {
    v1::Ancestor {
        generation: ancestor.generation,
        individual: ancestor.individual,
        fitness: ancestor.fitness,
        operator: match ancestor.birth.as_ref().map(|birth| birth.operator) {
            None => BirthOperator::Unspecified,
            Some(Operator::First) => BirthOperator::First,
            Some(Operator::Elite) => BirthOperator::Elite,
            Some(Operator::Copy) => BirthOperator::Copy,
            Some(Operator::Crossover) => BirthOperator::Crossover,
            Some(Operator::Line) => BirthOperator::Line,
        }
        .into(),
        genes: ancestor.n_surviving as u32,
        new_genes: ancestor.birth.as_ref().map_or(0, |birth| birth.n_new as u32),
        parents: ancestor
            .birth
            .into_iter()
            .flat_map(|birth| birth.parents)
            .map(|parent| GenesOfParent {
                individual: parent.individual,
                genes: parent.n_genes as u32,
                generation: Some(parent.generation)
                    .filter(|generation| generation + 1 != ancestor.generation),
            })
            .collect(),
    }
}

/// The error if the algorithm draws individuals from a distribution.
pub fn no_parents(experiment: &StoredExperiment, config: &ExperimentConfig) -> QueryError {
    QueryError::NoLineage(format!(
        "experiment {} evolves a distribution, by {}: its individuals have no parents",
        experiment.id, config.algorithm.name
    ))
}

fn too_deep() -> QueryError {
    QueryError::NoLineage("the lineage is too large: ask for less depth".to_owned())
}

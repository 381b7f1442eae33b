//! Finds the ancestors of an individual by repeating its generations.

use evolution::{ALGORITHMS, Ancestor, Checkpoint, Evolution, Operator, Pedigree, Told};
use experiment_file::{AlgorithmDescription, Keeps};
use swarm_proto::v1::{
    self, BirthOperator, GenesOfParent, GetLineageRequest, GetLineageResponse, PopulationLineage,
};
use tonic::Status;

use crate::{
    Address, Who,
    limits::{ANCESTORS_MAX, LINEAGE_GENES_MAX},
    store::{ExperimentRecord, LogEntry, Store, StoredExperiment},
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
        // Before the log is read, which may be long, while others wait for the store.
        check_size(&experiment, generation + 1 - first)?;
        if keeps_no_individuals(&experiment) {
            return Err(no_parents(&experiment));
        }
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
        let names: Vec<String> = config.algorithm.populations.keys().cloned().collect();
        let mut pedigrees = vec![Pedigree::starting_at(first); names.len()];
        let mut evolution =
            Evolution::restore(&checkpoint).map_err(|error| other(error.to_string()))?;
        for (of, entry) in &log {
            let births = evolution.births().ok_or_else(|| no_parents(&experiment))?;
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
        Ok(GetLineageResponse {
            populations: populations.into_iter().map(lineage).collect(),
            experiment_id: id.0,
        })
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

/// Checks that the genes of this number of generations are within the limit.
fn check_size(experiment: &ExperimentRecord, n_generations: u64) -> Result<(), QueryError> {
    let n_individuals = experiment.summary.population_size.saturating_mul(n_generations);
    match n_individuals.saturating_mul(experiment.genotype_len) {
        n_genes if n_genes > LINEAGE_GENES_MAX => Err(too_deep()),
        _ => Ok(()),
    }
}

/// Whether the algorithm keeps no individuals, so that nobody can be a parent. Of those that keep
/// some, CMA-MAE draws from distributions, too.
fn keeps_no_individuals(experiment: &ExperimentRecord) -> bool {
    let algorithm = AlgorithmDescription::find(ALGORITHMS, &experiment.summary.algorithm);
    algorithm.is_some_and(|found| matches!(found.keeps, Keeps::Vectors | Keeps::Matrix))
}

/// The error if the algorithm draws individuals from a distribution.
pub fn no_parents(experiment: &ExperimentRecord) -> QueryError {
    QueryError::NoLineage(format!(
        "experiment {} evolves a distribution, by {}: its individuals have no parents",
        experiment.id, experiment.summary.algorithm
    ))
}

fn too_deep() -> QueryError {
    QueryError::NoLineage("the lineage is too large: ask for less depth".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queries::families::tests::store_with;

    /// Why there is no lineage in a database without a log.
    fn refusal(algorithm: &str, edit: &str) -> QueryError {
        let (_directory, store, id) = store_with(algorithm, 3);
        let edit = format!("DELETE FROM fitness_log; {edit}");
        store.connection().execute_batch(&edit).unwrap();
        let address = format!("{id}@2/0").parse().unwrap();
        StoredLineage::read(&store, address, 9).unwrap_err()
    }

    #[test]
    fn a_lineage_that_is_too_large_or_without_parents_is_refused_before_the_log_is_read() {
        let error = refusal("GA", "");
        assert!(matches!(error, QueryError::DamagedLog { .. }), "{error}");
        let error = refusal("GA", "UPDATE experiments SET genotype_len = 1 << 40");
        assert!(error.to_string().contains("too large"), "{error}");
        let error = refusal("SNES", "");
        assert!(error.to_string().contains("by SNES: its individuals have no parents"), "{error}");
    }
}

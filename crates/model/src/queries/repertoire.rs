//! Reads repertoires: the elites after a generation, recomputed from the fitness log.

use std::collections::BTreeMap;

use evolution::{ALGORITHMS, EliteReport, Repertoire};
use experiment_file::{AlgorithmDescription, DescriptorConfig, LearnsFrom, ParameterValue};
use swarm_proto::v1::{
    self, CorrectedFigures, DescriptorAxis, GetRepertoireRequest, GetRepertoireResponse,
};
use tonic::Status;

use crate::{Address, Cell, Who, ids::ExperimentId, store::Store};

use super::{
    QueryError, Reader, StoredGeneration, ancestry::Ancestry, config, experiment,
    generation::RepeatedGeneration,
};

impl Reader {
    /// The repertoire of an experiment after a generation.
    pub async fn get_repertoire(
        &self,
        request: GetRepertoireRequest,
    ) -> Result<GetRepertoireResponse, Status> {
        let GetRepertoireRequest { experiment_id, generation } = request;
        let id = ExperimentId(experiment_id);
        let read = move |store: &_| read(store, id, generation);
        self.reconstruct(read, |stored| message(&stored)).await
    }

    /// The address with the elite of a cell in place of the cell.
    pub(super) async fn resolve(&self, address: Address) -> Result<Address, Status> {
        let Who::Cell(generation, cell) = address.who else { return Ok(address) };
        let id = address.experiment;
        let read = move |store: &_| read(store, id, Some(generation));
        self.reconstruct(read, move |stored| elite_of(&stored, cell)).await
    }
}

/// The stored data of the elites after a generation.
#[derive(Debug)]
pub(super) struct StoredElites {
    /// The generation.
    pub generation: StoredGeneration,
    /// The experiments in which they were born.
    ancestry: Ancestry,
}

impl StoredElites {
    /// The message about an elite.
    pub fn message(&self, elite: &EliteReport<'_>) -> v1::Elite {
        v1::Elite {
            generation: elite.generation,
            individual: elite.individual,
            cell: elite.cell.clone(),
            fitness: elite.fitness,
            descriptors: elite.descriptors.clone(),
            trials: elite.n_trials,
            judged: elite.judged.as_ref().map(|judged| v1::JudgedElite {
                fitness: judged.fitness,
                descriptors: judged.descriptors.clone(),
                cell: judged.cell.clone(),
            }),
            experiment_id: self.ancestry.experiment_of(elite.generation).0,
        }
    }
}

fn read(
    store: &Store,
    id: ExperimentId,
    generation: Option<u64>,
) -> Result<StoredElites, QueryError> {
    read_of(store, id, generation, LearnsFrom::Descriptors)?
        .map_err(|algorithm| QueryError::NoRepertoire { experiment: id, algorithm })
}

/// The elites of an experiment whose algorithm learns in this way; otherwise the name of its
/// algorithm.
pub(super) fn read_of(
    store: &Store,
    id: ExperimentId,
    generation: Option<u64>,
    learns_from: LearnsFrom,
) -> Result<Result<StoredElites, String>, QueryError> {
    let found = experiment(store, id)?;
    let algorithm = AlgorithmDescription::find(ALGORITHMS, &found.summary.algorithm);
    if !algorithm.is_some_and(|algorithm| algorithm.learns_from == learns_from) {
        return Ok(Err(found.summary.algorithm.clone()));
    }
    let latest = found.n_generations().saturating_sub(1);
    let ancestry = Ancestry::read(store, &found)?;
    let generation = StoredGeneration::read(store, id, generation.unwrap_or(latest))?;
    Ok(Ok(StoredElites { generation, ancestry }))
}

/// Recomputes a repertoire, and passes it to `then`; CPU-bound.
fn with_repertoire<T>(
    stored: &StoredGeneration,
    then: impl FnOnce(&Repertoire<'_>) -> Result<T, QueryError>,
) -> Result<T, QueryError> {
    let RepeatedGeneration { told, after, .. } = stored.repeat()?;
    let repertoire = after.elites(&told.end).ok_or_else(|| QueryError::NoRepertoire {
        experiment: stored.experiment.id,
        algorithm: stored.experiment.summary.algorithm.clone(),
    })?;
    then(&repertoire)
}

/// The address of the fittest elite in a cell, by evidence.
fn elite_of(stored: &StoredElites, cell: Cell) -> Result<Address, QueryError> {
    let StoredElites { generation: stored, ancestry } = stored;
    with_repertoire(stored, |repertoire| {
        let mut elites = repertoire.by_cell().into_iter();
        let found = elites.find(|elite| elite.cell == cell.indices());
        let elite = found.ok_or(QueryError::EmptyCell {
            experiment: stored.experiment.id,
            generation: stored.of.generation,
            cell,
        })?;
        Ok(Address {
            experiment: ancestry.experiment_of(elite.generation),
            who: Who::Individual(elite.generation, elite.individual),
        })
    })
}

fn message(elites: &StoredElites) -> Result<GetRepertoireResponse, QueryError> {
    let stored = &elites.generation;
    let config = config(&stored.experiment, stored.of.generation)?;
    with_repertoire(stored, |repertoire| {
        let figures = repertoire.figures();
        let shown = if figures.is_some() { repertoire.corrected() } else { repertoire.by_cell() };
        let born = |elite: &EliteReport<'_>| (elite.generation, elite.individual);
        let places: BTreeMap<(u64, u32), u32> =
            repertoire.elites.iter().map(born).zip(0..).collect();
        Ok(GetRepertoireResponse {
            generation: stored.of.generation,
            axes: config.algorithm.descriptors.iter().map(axis).collect(),
            elites: repertoire.elites.iter().map(|elite| elites.message(elite)).collect(),
            shown: shown.into_iter().map(|elite| places[&born(elite)]).collect(),
            corrected: figures.map(|figures| CorrectedFigures {
                qd_score: figures.qd_score,
                coverage: figures.coverage,
                stay: figures.stay,
            }),
        })
    })
}

fn axis(descriptor: &DescriptorConfig) -> DescriptorAxis {
    let DescriptorConfig { measure, summarises, range: [low, high], cells } = descriptor;
    let of = name_of(*summarises);
    DescriptorAxis { measure: measure.clone(), of, low: *low, high: *high, cells: *cells }
}

/// The name of a value in files.
pub(super) fn name_of(value: impl Into<ParameterValue>) -> String {
    match value.into() {
        ParameterValue::Name(name) => name,
        _ => String::new(),
    }
}

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
    QueryError, Reader, StoredGeneration, config, experiment, generation::RepeatedGeneration,
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
        let (generation, individual) =
            self.reconstruct(read, move |stored| elite_of(&stored, cell)).await?;
        Ok(Address { who: Who::Individual(generation, individual), ..address })
    }
}

fn read(
    store: &Store,
    id: ExperimentId,
    generation: Option<u64>,
) -> Result<StoredGeneration, QueryError> {
    read_of(store, id, generation, LearnsFrom::Descriptors)?
        .map_err(|algorithm| QueryError::NoRepertoire { experiment: id, algorithm })
}

/// A generation of an experiment whose algorithm learns in this way; otherwise the name of its
/// algorithm.
pub(super) fn read_of(
    store: &Store,
    id: ExperimentId,
    generation: Option<u64>,
    learns_from: LearnsFrom,
) -> Result<Result<StoredGeneration, String>, QueryError> {
    let found = experiment(store, id)?;
    let algorithm = AlgorithmDescription::find(ALGORITHMS, &found.summary.algorithm);
    if !algorithm.is_some_and(|algorithm| algorithm.learns_from == learns_from) {
        return Ok(Err(found.summary.algorithm.clone()));
    }
    let latest = found.n_generations().saturating_sub(1);
    StoredGeneration::read(store, id, generation.unwrap_or(latest)).map(Ok)
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

/// The birth of the fittest elite in a cell, by evidence.
fn elite_of(stored: &StoredGeneration, cell: Cell) -> Result<(u64, u32), QueryError> {
    with_repertoire(stored, |repertoire| {
        let mut elites = repertoire.by_cell().into_iter();
        let found = elites.find(|elite| elite.cell == cell.indices());
        found.map(|elite| (elite.generation, elite.individual)).ok_or(QueryError::EmptyCell {
            experiment: stored.experiment.id,
            generation: stored.of.generation,
            cell,
        })
    })
}

fn message(stored: &StoredGeneration) -> Result<GetRepertoireResponse, QueryError> {
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
            elites: repertoire.elites.iter().map(elite).collect(),
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

pub(super) fn elite(elite: &EliteReport<'_>) -> v1::Elite {
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
    }
}

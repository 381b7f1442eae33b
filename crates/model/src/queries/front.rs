//! Reads fronts: the elites after a generation, recomputed from the fitness log.

use experiment_file::{AimConfig, LearnsFrom};
use swarm_proto::v1::{self, GetFrontRequest, GetFrontResponse};
use tonic::Status;

use crate::ids::ExperimentId;

use super::{
    QueryError, Reader, config,
    generation::RepeatedGeneration,
    repertoire::{StoredElites, name_of, read_of},
};

impl Reader {
    /// The front of an experiment after a generation.
    pub async fn get_front(&self, request: GetFrontRequest) -> Result<GetFrontResponse, Status> {
        let GetFrontRequest { experiment_id, generation, reference } = request;
        let experiment = ExperimentId(experiment_id);
        let read = move |store: &_| {
            read_of(store, experiment, generation, LearnsFrom::Aims)?
                .map_err(|algorithm| QueryError::NoFront { experiment, algorithm })
        };
        self.reconstruct(read, move |stored| message(&stored, &reference)).await
    }
}

fn message(elites: &StoredElites, reference: &[f64]) -> Result<GetFrontResponse, QueryError> {
    let stored = &elites.generation;
    let aims = config(&stored.experiment, stored.of.generation)?.algorithm.aims;
    let reference = check(reference, &aims)?;
    let RepeatedGeneration { told, after, .. } = stored.repeat()?;
    let front = after.front(&told.end).ok_or_else(|| QueryError::NoFront {
        experiment: stored.experiment.id,
        algorithm: stored.experiment.summary.algorithm.clone(),
    })?;
    Ok(GetFrontResponse {
        generation: stored.of.generation,
        aims: aims.iter().map(aim).collect(),
        elites: front.elites.iter().map(|elite| elites.message(elite)).collect(),
        shown: front.shown().into_iter().map(|place| place as u32).collect(),
        figures: front.figures(reference).map(|figures| v1::FrontFigures {
            hypervolume: figures.hypervolume,
            reference: figures.reference,
            stay: figures.stay,
        }),
    })
}

/// A reference point with a number for fitness and for each aim, if there is one.
fn check<'a>(reference: &'a [f64], aims: &[AimConfig]) -> Result<Option<&'a [f64]>, QueryError> {
    let expected = 1 + aims.len();
    let is_right = reference.len() == expected && reference.iter().all(|value| value.is_finite());
    match reference {
        [] => Ok(None),
        _ if is_right => Ok(Some(reference)),
        _ => {
            let names = aims.iter().map(|aim| aim.measure.as_str());
            let names: Vec<&str> = ["fitness"].into_iter().chain(names).collect();
            let (found, aims) = (reference.len(), names.join(", "));
            Err(QueryError::WrongReference { found, expected, aims })
        }
    }
}

fn aim(aim: &AimConfig) -> v1::Aim {
    v1::Aim {
        measure: aim.measure.clone(),
        of: name_of(aim.summarises),
        direction: name_of(aim.direction),
    }
}

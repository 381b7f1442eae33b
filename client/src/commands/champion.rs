//! `swarmctl champion`: the best genotype so far, as JSON.

use swarm_proto::v1::{Experiment, GetChampionResponse};

use crate::{connection::Connection, error::Error, json, progress::Progress};

/// Prints JSON in any case.
pub async fn champion(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let experiment = connection.experiment(experiment_id).await?;
    let champion = connection.champion(experiment_id).await?;
    progress.print(&champion_document(&experiment, &champion)?)
}

/// A champion as `champion` prints it and `run` stores it.
pub fn champion_document(
    experiment: &Experiment,
    champion: &GetChampionResponse,
) -> Result<String, Error> {
    let document = json::ChampionDocument::new(experiment, champion).map_err(|error| {
        Error::Internal(format!("the coordinator's network is not JSON: {error}"))
    })?;
    Ok(json::document(&document))
}

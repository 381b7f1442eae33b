//! `swarmctl champion`: the best genotype so far, as JSON.

use swarm_proto::v1::GetChampionResponse;

use crate::{connection::Connection, error::Error, json, progress::Progress};

/// Prints JSON in any case.
pub async fn champion(
    connection: &Connection,
    experiment_id: u64,
    progress: &mut Progress,
) -> Result<(), Error> {
    let champion = connection.champion(experiment_id).await?;
    progress.print(&champion_document(&champion)?)
}

/// A champion as `champion` prints it and `run` stores it.
pub fn champion_document(champion: &GetChampionResponse) -> Result<String, Error> {
    let document = json::ChampionDocument::new(champion).map_err(|error| {
        Error::Internal(format!("the coordinator's network is not JSON: {error}"))
    })?;
    Ok(json::document(&document))
}

//! `swarmctl champion`: the best genotype so far, as JSON.

use clap::Args;
use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::Remote;
use crate::{args::ExperimentId, connection::Connection, error::Error, json, progress::Progress};

/// Print the best genotype so far and the network that it encodes, as JSON.
///
/// `fitness` is the mean on held-out trials, which selected nothing, once the
/// champion has been re-evaluated on them; `fitness_when_chosen` is the fitness
/// that made it the champion.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ChampionArgs {
    #[command(flatten)]
    experiment: ExperimentId,
}

const HELP: &str = "\
Examples:
  swarmctl champion 3 > champion.json
  swarmctl champion 3 | jq .network";

impl Remote for ChampionArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiment = connection.experiment(self.experiment.id).await?;
        let champion = connection.champion(self.experiment.id).await?;
        progress.print(&champion_document(&experiment, &champion)?)
    }
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

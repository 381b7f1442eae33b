//! `swarmctl champion`: the best genotype so far, as JSON.

use clap::Args;
use swarm_proto::v1::{Experiment, GetChampionResponse};

use super::Remote;
use crate::{args::ExperimentId, connection::Connection, error::Error, json, progress::Progress};

/// Print the best genotype so far and the network that it encodes, as JSON.
///
/// `judged` says what it is worth: the mean, with its 95 % interval, on trials that
/// selected nothing, once the run has ended. `selection` is the mean on the held-out
/// trials by which it was compared with other candidates, and `fitness_when_chosen` that
/// of its generation, for which it became one: both are optimistic.
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

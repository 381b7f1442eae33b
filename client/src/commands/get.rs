//! `swarmctl get`: the experiment file of an experiment.

use clap::Args;
use swarm_proto::v1::GetExperimentRequest;

use super::Remote;
use crate::{
    args::Target, change::Json, connection::Connection, error::Error, json, progress::Progress,
};

/// Print the experiment file of an experiment.
///
/// It is in canonical form: every key that has an effect, the seed included. Submitted again,
/// it gives the same bits.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct GetArgs {
    #[command(flatten)]
    target: Target,
}

const HELP: &str = "\
Examples:
  swarmctl get 3 > experiment.json
  swarmctl get 3 | swarmctl validate -";

impl Remote for GetArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiment_id = connection.one(&self.target.subject).await?.id;
        let request = GetExperimentRequest { experiment_id };
        let response = connection.call(async |client| client.get_experiment(request).await).await?;
        progress.print(&json::document(&Json::parse(&response.config_json)))
    }
}

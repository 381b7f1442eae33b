//! `swarmctl get`: the file of a stored experiment.

use clap::Args;

use crate::{
    args::Target, change::Json, connection::Connection, error::Error, progress::Progress,
    remote::Remote,
};

/// Print the experiment file of an experiment.
///
/// The file is in canonical form: every key that has an effect, including the seed. If you
/// submit it again, it gives the same bits.
#[derive(Debug, Args)]
#[command(after_help = GET_HELP)]
pub struct GetArgs {
    #[command(flatten)]
    target: Target,
}

const GET_HELP: &str = "\
Examples:
  swarmctl get 3 > experiment.json
  swarmctl get 3 | swarmctl validate -";

impl Remote for GetArgs {
    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let experiment_id = connection.one(&self.target.subject).await?.id;
        let (_, config_json) = connection.stored(experiment_id).await?;
        progress.print_document(&Json::parse(&config_json))
    }
}

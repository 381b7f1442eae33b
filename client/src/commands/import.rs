//! `swarmctl import`: imports the experiment of a bundle.

use std::path::PathBuf;

use clap::Args;

use super::export;
use crate::{
    connection::Connection, error::Error, json, place::Intent, progress::Progress, remote::Remote,
    text,
};

/// Import the experiment of a bundle into a coordinator or a data directory.
///
/// You can list, plot, compare and fork it like any other ended experiment. Before storing
/// anything, the command checks everything that follows from the fitness log. It does not
/// simulate the fitness again: use `swarmctl verify` for that. A second import changes nothing.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct ImportArgs {
    /// The bundle that `swarmctl export` wrote.
    file: PathBuf,
}

const HELP: &str = "\
Examples:
  swarmctl import leader.zip
  swarmctl import leader.zip --output json | jq .id";

impl Remote for ImportArgs {
    fn intent(&self) -> Intent {
        Intent::Add
    }

    async fn execute(self, connection: &Connection, progress: &mut Progress) -> Result<(), Error> {
        let bytes = export::read(&self.file)?;
        let imported = connection.import(&bytes).await.map_err(|error| match error {
            Error::Input(what) => Error::of_file(&self.file, what),
            error => error,
        });
        let (experiment, is_new) = imported?;
        if progress.is_json() {
            return progress.print_document(&json::ExperimentDocument::from(&experiment));
        }
        let title = text::title(&experiment);
        progress.print(&match is_new {
            true => format!("{title}: imported"),
            false => format!("{title}: it is there already"),
        })
    }
}

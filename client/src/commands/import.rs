//! `swarmctl import`: takes an experiment of a bundle in.

use std::path::PathBuf;

use clap::Args;

use super::export;
use crate::{
    connection::Connection, error::Error, json, place::Intent, progress::Progress, remote::Remote,
    text,
};

/// Take the experiment of a bundle into a coordinator or a data directory.
///
/// It is listed, plotted, compared and forked like any other that has ended. Everything that
/// follows from the fitness log is checked before anything is stored; whether the
/// fitness is what a simulation gives, `swarmctl verify` says. To import again changes nothing.
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
            Error::Input(what) => Error::Input(format!("{}: {what}", self.file.display())),
            error => error,
        });
        let (experiment, is_new) = imported?;
        progress.print(&if progress.is_json() {
            json::document(&json::ExperimentDocument::from(&experiment))
        } else {
            let title = text::title(&experiment);
            match is_new {
                true => format!("{title}: imported"),
                false => format!("{title}: it is there already"),
            }
        })
    }
}

//! `swarmctl schema`: the JSON Schema of experiment files.

use crate::{error::Error, json, progress::Progress};

/// Print the JSON Schema of experiment files.
///
/// Editors use it to complete and check experiment files.
#[derive(Debug, clap::Args)]
pub struct SchemaArgs {}

/// Prints the schema.
pub fn schema(progress: &mut Progress) -> Result<(), Error> {
    progress.print(&json::document(&experiment_file::json_schema(evolution::ALGORITHMS)))
}

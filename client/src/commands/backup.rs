//! `swarmctl backup`: a consistent copy of a data directory.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use clap::Args;
use model::store::{self, Backup, StoreError};

use super::doctor::print_inspection;
use crate::{
    error::Error,
    output_file::{Overwrite, exists},
    progress::Progress,
    waiting,
};

/// Copy a data directory, even while a coordinator uses it.
///
/// The copy is a snapshot of one moment. The command checks the copy like `doctor`. The
/// copy appears only when it is complete. A coordinator on the copy continues every experiment
/// from that moment, to the same bits.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct BackupArgs {
    /// Directory of the copy: new or empty, or with --force a data directory to replace.
    #[arg(value_name = "TO")]
    to: PathBuf,
    #[command(flatten)]
    overwrite: Overwrite,
}

const HELP: &str = "\
Exit code 11 if something is damaged. The command names damaged experiments, and
copies them unchanged beside the sound ones. If the database as a whole is
damaged, there is no copy.

Examples:
  swarmctl backup --data-dir ./swarm-data backups/$(date +%F)
  coordinator --data-dir backups/2026-11-22      # to restore it";

/// Makes the copy.
pub fn backup(data_dir: &Path, args: &BackupArgs, progress: &mut Progress) -> Result<(), Error> {
    let what = format!("copying {} and checking the copy", data_dir.display());
    let copied = args.overwrite.data_directory(data_dir, &args.to, |to| {
        waiting::busy(&what, || store::backup(data_dir, to)).map_err(|error| refused(&error))
    });
    match copied? {
        Backup::Made(mut inspection) => {
            // The inspection has the path at which the copy was made, before it was moved.
            inspection.path =
                args.to.join(inspection.path.file_name().expect("a database has a name"));
            print_inspection(&inspection, progress)?;
            let damaged: BTreeSet<u64> = inspection
                .findings
                .iter()
                .filter_map(|finding| Some(finding.experiment?.0))
                .collect();
            if damaged.is_empty() {
                return Ok(());
            }
            let damaged: Vec<String> = damaged.iter().map(ToString::to_string).collect();
            Err(Error::Damaged(format!(
                "the copy is complete, but these experiments are damaged in it, as in {}: {}",
                data_dir.display(),
                damaged.join(", ")
            )))
        }
        Backup::Damaged(inspection) => {
            print_inspection(&inspection, progress)?;
            let database = inspection.path.display();
            Err(Error::Damaged(format!("{database} is damaged, so it was not copied")))
        }
    }
}

/// The error that a data directory cannot be made.
pub fn refused(error: &StoreError) -> Error {
    match error {
        StoreError::NotEmpty { path } => exists(path),
        error => Error::from_store(error),
    }
}

//! `swarmctl man`: manual pages.

use std::path::PathBuf;

use clap::{Args as ClapArgs, CommandFactory as _};
use schemars::JsonSchema;
use serde::Serialize;

use crate::{
    cli::Args,
    error::Error,
    output_file::{Overwrite, unwritable},
    progress::Progress,
};

/// Write the manual pages of this program and its commands to a directory.
#[derive(Debug, ClapArgs)]
#[command(after_help = HELP)]
pub struct ManArgs {
    /// The directory, created if missing.
    pub directory: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

const HELP: &str = "\
Examples:
  swarmctl man ~/.local/share/man/man1    # then: man swarmctl, man swarmctl-run";

/// Written pages, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Written {
    /// The directory of the pages.
    directory: String,
}

/// Writes a page per command.
pub fn man(args: &ManArgs, progress: &mut Progress) -> Result<(), Error> {
    let directory = &args.directory;
    let pages = args.overwrite.begin_files(directory, &[])?;
    clap_mangen::generate_to(Args::command(), pages.unfinished())
        .map_err(|error| unwritable(directory, &error))?;
    pages.finish()?;
    let directory = directory.display().to_string();
    match progress.is_json() {
        true => progress.print_document(&Written { directory }),
        false => progress.print(&format!("manual pages are in {directory}")),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::output_format::OutputFormat;

    #[test]
    fn every_command_has_its_page() {
        let dir = tempfile::tempdir().unwrap();
        let directory = dir.path().join("man1");
        let mut progress = Progress::to(OutputFormat::Table, Box::new(std::io::sink()));
        let args = ManArgs { directory: directory.clone(), overwrite: Overwrite::default() };
        man(&args, &mut progress).unwrap();
        let page = fs::read_to_string(directory.join("swarmctl-submit.1")).unwrap();
        assert!(page.contains("Submit an experiment"), "{page}");
        assert!(directory.join("swarmctl.1").exists());
        assert!(!directory.join("swarmctl-referee.1").exists());
    }
}

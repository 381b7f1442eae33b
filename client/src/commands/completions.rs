//! `swarmctl completions`: what a shell needs to complete the command line.

use clap::CommandFactory as _;
use clap_complete::Shell;

use crate::{args::Args, error::Error, progress::Progress};

/// Prints the shell's script.
pub fn completions(shell: Shell, progress: &mut Progress) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "swarmctl", &mut script);
    progress.print(String::from_utf8_lossy(&script).trim_end())
}

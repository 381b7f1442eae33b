//! `swarmctl completions`: a script that completes the command line in a shell.

use clap::{Args as ClapArgs, CommandFactory as _};
use clap_complete::Shell;
use schemars::JsonSchema;
use serde::Serialize;

use crate::{cli::Args, error::Error, progress::Progress};

/// Print a script that completes this program's command line in a shell.
#[derive(Debug, ClapArgs)]
#[command(after_help = HELP)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

const HELP: &str = "\
The following line also completes numbers and names of experiments. It requests
them from the coordinator of the environment or the settings file:
  source <(COMPLETE=bash swarmctl)                # in ~/.bashrc; also zsh, fish

Examples:
  source <(swarmctl completions bash)             # in ~/.bashrc
  swarmctl completions zsh > ~/.zfunc/_swarmctl   # a directory in $fpath
  swarmctl completions fish > ~/.config/fish/completions/swarmctl.fish";

/// Completions, for programs.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Completions<'a> {
    /// The shell's script.
    script: &'a str,
}

/// Prints the shell's script.
pub fn completions(shell: Shell, progress: &mut Progress) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "swarmctl", &mut script);
    let script = String::from_utf8_lossy(&script);
    match progress.is_json() {
        true => progress.print_document(&Completions { script: script.trim_end() }),
        false => progress.print(script.trim_end()),
    }
}

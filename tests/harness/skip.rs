//! Reports tests that this machine cannot run.
//!
//! `.ci/run` lists the lines that begin with `SKIPPED`, and fails if one of them says
//! that something could have been installed.

use std::io::{self, Write as _};

/// Prints that a test, or a part of it, is skipped because it needs something that cannot be
/// installed: a privilege, a device, a folder.
pub fn skipped(reason: &str) {
    say(&format!("SKIPPED: {reason}"));
}

/// Prints that a test, or a part of it, is skipped because a program is missing, and the command
/// that installs it.
pub fn skipped_for_want_of(program: &str, install: &str) {
    say(&format!("SKIPPED, but can be installed: no {program}; {install}"));
}

/// Writes a line that bypasses the capture of a test's output, which hides `eprintln!` when the
/// test passes.
fn say(line: &str) {
    // One write, so that lines of other tests do not split it.
    let _ = io::stderr().write_all(format!("\n{line}\n").as_bytes());
}

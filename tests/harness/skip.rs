//! Tests that this machine cannot run say so.
//!
//! `.ci/run` lists the lines that begin with `SKIPPED`, and fails if one of them says
//! that something could have been installed.

use std::io::{self, Write as _};

/// Says that a test, or a part of it, is skipped since something is missing that
/// nobody can install: a privilege, a device, a folder.
pub fn skipped(reason: &str) {
    say(&format!("SKIPPED: {reason}"));
}

/// Says that a test, or a part of it, is skipped since a program is missing, and
/// with which command it is installed.
pub fn skipped_for_want_of(program: &str, install: &str) {
    say(&format!("SKIPPED, but can be installed: no {program}; {install}"));
}

/// Writes a line past the capture of a test's output: `eprintln!` would be swallowed
/// when the test passes.
fn say(line: &str) {
    // One write, which other tests' lines do not cut in two.
    let _ = io::stderr().write_all(format!("\n{line}\n").as_bytes());
}

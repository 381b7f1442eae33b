//! Programs to which the system gives too little.

use std::{
    fs,
    os::unix::fs::PermissionsExt as _,
    process::{Command, Output},
};

use harness::{binary, skipped};
use tempfile::TempDir;

/// Each program, with arguments for which it would wait, or ask somebody.
const PROGRAMS: [(&str, &[&str]); 3] = [
    ("swarmctl", &["--coordinator", "http://127.0.0.1:1", "list"]),
    ("worker", &["--coordinator", "http://127.0.0.1:1"]),
    ("coordinator", &["--listen", "127.0.0.1:0", "--data-dir", "data"]),
];

/// A directory that everybody may write to.
fn open_directory() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o777)).unwrap();
    directory
}

/// Runs a program under another, which limits it, for at most ten seconds.
fn limited(limits: &[&str], program: &str, args: &[&str]) -> Output {
    let directory = open_directory();
    let mut command = Command::new("timeout");
    command.args(["--signal=TERM", "--kill-after=5", "10"]).args(limits);
    command.arg(binary(program)).args(args).current_dir(directory.path());
    command.env("HOME", directory.path()).env("RUST_BACKTRACE", "1").output().unwrap()
}

/// One line says what is missing, and the exit code is the one for that.
fn assert_starved(output: &Output, what: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(71), "{what}: {text}");
    assert_eq!(text.lines().count(), 1, "{what}: {text}");
    assert!(text.contains("too few threads or file descriptors"), "{what}: {text}");
}

/// What makes a program one of a user with so many processes; none if that is not possible.
fn as_nobody(user: u32, n_processes: u32) -> Vec<String> {
    let (user, nproc) = (format!("--reuid={user}"), format!("--nproc={n_processes}"));
    ["setpriv", &user, "--regid=65533", "--clear-groups", "prlimit", &nproc]
        .map(str::to_owned)
        .to_vec()
}

fn is_limited_by_processes() -> bool {
    let limits = as_nobody(65_530, 50);
    let limits: Vec<&str> = limits.iter().map(String::as_str).collect();
    limited(&limits, "swarmctl", &["--version"]).status.success()
}

#[test]
fn a_program_that_is_given_no_threads_says_so_and_ends() {
    if !is_limited_by_processes() {
        return skipped("no right to be another user, whose processes are limited");
    }
    let limits = as_nobody(65_531, 1);
    let limits: Vec<&str> = limits.iter().map(String::as_str).collect();
    for (program, args) in PROGRAMS {
        assert_starved(&limited(&limits, program, args), program);
    }
}

#[test]
fn a_program_that_is_given_few_threads_makes_do_or_says_so() {
    if !is_limited_by_processes() {
        return skipped("no right to be another user, whose processes are limited");
    }
    for n_processes in 2..6 {
        let limits = as_nobody(65_532, n_processes);
        let limits: Vec<&str> = limits.iter().map(String::as_str).collect();
        let (program, args) = PROGRAMS[0];
        let output = limited(&limits, program, args);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{n_processes}: {text}");
    }
}

#[test]
fn a_program_that_is_given_no_file_descriptors_says_so_and_ends() {
    for (program, args) in PROGRAMS {
        assert_starved(&limited(&["prlimit", "--nofile=4"], program, args), program);
    }
}

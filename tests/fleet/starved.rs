//! Programs that get too few resources from the system.

use std::{
    env, fs,
    os::unix::fs::PermissionsExt as _,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use harness::{Experiment, SmallDisk, binary, skipped};
use tempfile::TempDir;

/// Each program, with arguments with which it would wait or call a coordinator.
const PROGRAMS: [(&str, &[&str]); 3] = [
    ("swarmctl", &["--coordinator", "http://127.0.0.1:1", "list"]),
    ("worker", &["--coordinator", "http://127.0.0.1:1"]),
    ("coordinator", &["--listen", "127.0.0.1:0", "--data-dir", "data"]),
];

/// A directory to which every user may write.
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

/// Asserts that one line names the missing resource, with the exit code for that.
fn assert_starved(output: &Output, what: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(71), "{what}: {text}");
    assert_eq!(text.lines().count(), 1, "{what}: {text}");
    assert!(text.contains("too few threads or file descriptors"), "{what}: {text}");
}

/// A command prefix that runs a program as a user with this limit of processes; `None` if that is
/// not possible.
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
fn a_program_that_is_given_few_threads_runs_or_says_so() {
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

/// Runs a command of the shell, in which `swarmctl`, `worker` and `coordinator` are ours, for at
/// most half a minute.
fn shell(directory: &Path, line: &str) -> Output {
    let programs = ["swarmctl", "worker", "coordinator"].map(binary);
    let mut path: Vec<PathBuf> =
        programs.iter().map(|program| program.parent().unwrap().to_owned()).collect();
    path.extend(env::split_paths(&env::var_os("PATH").unwrap()));
    Command::new("timeout")
        .args(["--kill-after=5", "30", "sh", "-c", line])
        .current_dir(directory)
        .env("PATH", env::join_paths(path).unwrap())
        .env("HOME", directory)
        .env("RUST_BACKTRACE", "1")
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

/// The last line on standard error; panics unless the exit code is `code`.
fn ends_with(output: &Output, code: i32, what: &str) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{what}: {text}");
    assert!(!text.contains("panicked") && !text.contains("backtrace"), "{what}: {text}");
    text.lines().last().unwrap_or_default().to_owned()
}

/// A short experiment, and the command that runs it.
fn run_line() -> (Experiment, String) {
    let experiment = Experiment::tiny(2);
    let line = format!("swarmctl run {} --data-dir data", experiment.path().display());
    (experiment, line)
}

fn champion_in(data_dir: &Path) -> bool {
    let names = fs::read_dir(data_dir).unwrap().map(|entry| entry.unwrap().file_name());
    names.into_iter().any(|name| name.to_string_lossy().ends_with(".champion.json"))
}

#[test]
fn few_file_descriptors_are_enough_or_one_line_says_that_they_are_not() {
    let (_experiment, run) = run_line();
    let coordinator = "coordinator --listen 127.0.0.1:0 --data-dir /dev/null/none";
    for n_files in [5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 20, 24, 30, 64] {
        for line in [&*run, "swarmctl list --data-dir data", coordinator] {
            let directory = open_directory();
            let output = shell(directory.path(), &format!("prlimit --nofile={n_files} {line}"));
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            // With enough resources, the error is about the command line.
            match output.status.code() {
                Some(71) if n_files < 64 => assert_starved(&output, line),
                Some(0 | 2 | 3) if n_files > 24 => {}
                other => panic!("{n_files}, {line}: {other:?}: {text}"),
            }
        }
    }
}

#[test]
fn little_memory_is_enough_or_one_line_says_that_it_is_not() {
    let (_experiment, run) = run_line();
    // With less than the program itself takes, the system does not start it.
    let program_mib = fs::metadata(binary("swarmctl")).unwrap().len() >> 20;
    for more_mib in [20, 30, 40, 60, 90, 140, 240, 440, 940] {
        let mib = program_mib + more_mib;
        for line in [&*run, "swarmctl list --coordinator http://127.0.0.1:1"] {
            let directory = open_directory();
            let line = format!("prlimit --as={} {line}", mib << 20);
            let output = shell(directory.path(), &line);
            match output.status.code() {
                Some(71) if more_mib < 940 => assert_starved(&output, &line),
                Some(0 | 4) if more_mib >= 40 => {}
                _ => panic!("{mib} MiB, {line}: {output:?}"),
            }
        }
    }
}

#[test]
fn a_full_standard_output_loses_text_and_no_result() {
    let (_experiment, run) = run_line();
    for output_format in ["", "--output json"] {
        let directory = open_directory();
        let output = shell(directory.path(), &format!("{run} {output_format} > /dev/full"));
        let line = ends_with(&output, 1, &run);
        assert!(line.contains("cannot write standard output: No space"), "{line}");
        assert!(champion_in(&directory.path().join("data")));
        let history = "swarmctl history 1 --data-dir data";
        let history = shell(directory.path(), history);
        assert!(history.status.success());
        let output = shell(directory.path(), "swarmctl list --data-dir data > /dev/full");
        assert!(ends_with(&output, 1, "list").contains("cannot write standard output"));
    }
    for line in ["swarmctl --help", "swarmctl schema", "swarmctl completions bash"] {
        let output = shell(Path::new("."), &format!("{line} > /dev/full"));
        assert!(ends_with(&output, 1, line).contains("cannot write standard output"), "{line}");
    }
}

#[test]
fn closed_and_full_standard_streams_stop_nothing() {
    let (_experiment, run) = run_line();
    for streams in ["<&- >&- 2>&-", "<&-", ">&-", "2>&-", "2> /dev/full"] {
        let directory = open_directory();
        let output = shell(directory.path(), &format!("{run} {streams}"));
        ends_with(&output, 0, streams);
        assert!(champion_in(&directory.path().join("data")), "{streams}");
    }
    for streams in ["> /dev/full 2> /dev/full", ">&- 2>&-"] {
        for (line, code) in [
            ("coordinator --health-check --listen 127.0.0.1:1", 1),
            ("worker --health-check --session-file none", 1),
            ("worker --coordinator ftp://nobody", 2),
            ("coordinator --listen 127.0.0.1:0 --data-dir /dev/null/none", 2),
        ] {
            let output = shell(Path::new("."), &format!("{line} {streams}"));
            ends_with(&output, code, line);
        }
    }
}

#[test]
fn a_full_disk_leaves_no_half_files_and_keeps_existing_ones() {
    let Some(disk) = SmallDisk::mount(200 << 10) else {
        return skipped("no right to mount a file system");
    };
    let (_experiment, run) = run_line();
    let directory = open_directory();
    ends_with(&shell(directory.path(), &run), 0, &run);
    let small = disk.path().display();
    fs::write(disk.path().join("a.svg"), "old").unwrap();
    disk.fill();
    for (line, name) in [
        ("plot 1 --data-dir data --force --to", "a.svg"),
        ("replay 1 --data-dir data --to", "a.html"),
        ("export 1 --data-dir data --to", "a.zip"),
        ("backup --data-dir data", "copy"),
        ("doctor --data-dir data --recover", "copy"),
    ] {
        let output = shell(directory.path(), &format!("swarmctl {line} {small}/{name}"));
        let said = ends_with(&output, 2, line);
        assert!(
            ["No space left", "no storage space", "disk is full"]
                .iter()
                .any(|message| said.contains(message)),
            "{said}"
        );
        assert!(!said.contains(".unfinished"), "{said}");
    }
    assert_eq!(fs::read_to_string(disk.path().join("a.svg")).unwrap(), "old");
    let mut names: Vec<_> =
        fs::read_dir(disk.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["a.svg", "ballast"]);
}

#[test]
fn directories_that_cannot_be_used_are_named_in_one_line() {
    if !is_limited_by_processes() {
        return skipped("no right to be another user, who may not write everywhere");
    }
    let (experiment, run) = run_line();
    let directory = open_directory();
    let nobody = "setpriv --reuid=65529 --regid=65533 --clear-groups";
    // Other users cannot read the temporary file, so they get a copy.
    let file = directory.path().join("tiny.json");
    fs::write(&file, experiment.text()).unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o644)).unwrap();
    let run_it = |dir: &str| format!("{nobody} swarmctl run tiny.json --data-dir {dir}");
    ends_with(&shell(directory.path(), &run), 0, &run);
    shell(directory.path(), "mkdir closed; chmod 700 closed; mkdir home; chmod 700 home");
    for (line, code, expected) in [
        (run_it("data"), 2, "cannot use the data directory"),
        (run_it("closed/data"), 2, "cannot use the data directory"),
        (run_it("/dev/null/data"), 2, "cannot use the data directory"),
        (format!("{nobody} swarmctl label 1 a=b --data-dir data"), 2, "cannot use the data"),
        (format!("{nobody} swarmctl doctor --data-dir closed"), 2, "Permission denied"),
        (format!("{nobody} swarmctl backup --data-dir closed copy"), 2, "Permission denied"),
        (format!("{nobody} swarmctl list --data-dir closed"), 2, "Permission denied"),
        (format!("HOME=$PWD/home {nobody} swarmctl list"), 2, "SWARM_CONFIG"),
        ("TMPDIR=/none swarmctl evaluate 1 --data-dir data --to e".into(), 1, "temporary"),
    ] {
        let said = ends_with(&shell(directory.path(), &line), code, &line);
        assert!(said.contains(expected), "{line}: {said}");
    }
    // Commands that only read still work.
    for line in ["list", "history 1", "simulate 1", "get 1"] {
        let line = format!("{nobody} swarmctl {line} --data-dir data");
        ends_with(&shell(directory.path(), &line), 0, &line);
    }
}

//! The health checks of the programs, as container engines run them.

use std::{path::Path, process::Command};

use harness::{CoordinatorProcess, Outcome, WorkerProcess, binary};
use tempfile::tempdir;

/// The one line of output; asserts this exit code.
fn line(program: &str, args: &[&str], code: i32) -> String {
    let outcome =
        Outcome::of_command(Command::new(binary(program)).arg("--health-check").args(args));
    assert_eq!(outcome.code, Some(code), "{outcome:#?}");
    let (said, silent) = match code {
        0 => (&outcome.stdout, &outcome.stderr),
        _ => (&outcome.stderr, &outcome.stdout),
    };
    assert_eq!((said.lines().count(), silent.as_str()), (1, ""), "{outcome:#?}");
    said.clone()
}

#[test]
fn a_coordinator_tells_its_health_by_exit_code_and_in_one_line() {
    let mut coordinator = CoordinatorProcess::start();
    let listen = ["--listen", coordinator.address()].map(str::to_owned);
    let listen = listen.each_ref().map(String::as_str);
    assert!(line("coordinator", &listen, 0).starts_with("healthy: "));
    coordinator.process.kill();
    let unhealthy = line("coordinator", &listen, 1);
    assert!(unhealthy.contains("no coordinator listens on"), "{unhealthy}");
    let unhealthy = line("coordinator", &["--tls-cert", "absent.pem", "--tls-key", "a.key"], 1);
    assert!(unhealthy.contains("absent.pem"), "{unhealthy}");
}

#[test]
fn a_worker_is_healthy_while_it_has_a_session() {
    let directory = tempdir().unwrap();
    let file = |name: &str| directory.path().join(name).to_str().unwrap().to_owned();
    let session = file("session");
    let unhealthy = line("worker", &["--session-file", &session], 1);
    assert!(unhealthy.contains("no session"), "{unhealthy}");

    let mut coordinator = CoordinatorProcess::start();
    let worker = WorkerProcess::start_with(&coordinator.url(), "w", &["--session-file", &session]);
    let (n_seen, _) = worker.process.find(0, "session", |line| line["message"] == "connected");
    while !Path::new(&session).metadata().is_ok_and(|file| file.len() > 0) {
        std::thread::yield_now();
    }
    let healthy = line("worker", &["--session-file", &session], 0);
    assert!(healthy.contains(&coordinator.url()), "{healthy}");

    coordinator.process.kill();
    worker.process.find(n_seen, "the end of the session", |line| line["level"] == "WARN");
    line("worker", &["--session-file", &session], 1);
    coordinator.restart();
    worker.process.find(n_seen, "another session", |line| line["message"] == "connected");
}

#[test]
fn a_session_file_that_cannot_be_written_is_bad_input() {
    let mut worker = Command::new(binary("worker"));
    worker.args(["--coordinator", "http://127.0.0.1:1", "--session-file", "/nonexistent/session"]);
    let outcome = Outcome::of_command(&mut worker);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert!(outcome.stderr.contains("/nonexistent/session"), "{}", outcome.stderr);
}

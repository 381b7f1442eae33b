//! `client/examples/submit.py`: any language with gRPC is a client.

use std::fs;

use harness::{CoordinatorProcess, Experiment, Outcome, PythonClient, WorkerProcess, undisturbed};
use serde_json::json;

const CLIENT_TOKEN: &str = "client-token-0123456789abcdef0123";
const WORKER_TOKEN: &str = "worker-token-0123456789abcdef0123";

/// Asserts that every generation was printed once, in order, with the digests of an undisturbed
/// run, and the digest of everything.
fn assert_undisturbed(outcome: &Outcome, digests: &[String]) {
    assert_eq!(outcome.code, Some(0), "{outcome:#?}");
    let (last, generations) = digests.split_last().unwrap();
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    let [first, shown @ .., champion, digest] = &*lines else { panic!("{outcome:#?}") };
    assert!(
        first.starts_with("experiment 1 (") && champion.starts_with("champion"),
        "{outcome:#?}"
    );
    assert_eq!(*digest, format!("digest {last}"));
    assert_eq!(shown.len(), generations.len(), "{outcome:#?}");
    for (i, (line, digest)) in shown.iter().zip(generations).enumerate() {
        assert!(line.starts_with(&format!("{}/{} ", i + 1, generations.len())), "{line}");
        assert!(line.ends_with(&digest[..12]), "{line}: {digest}");
    }
}

#[test]
fn a_python_script_submits_and_follows_to_the_undisturbed_digest() {
    let Some(python) = PythonClient::find() else { return };
    let experiment = Experiment::tiny(5);
    let digests = undisturbed(&experiment);
    let coordinator = CoordinatorProcess::start();
    let _worker = WorkerProcess::start(&coordinator, "w");
    let path = experiment.path();
    let args =
        [path.to_str().unwrap(), "--coordinator", &coordinator.url(), "--request-id", "mine"];
    assert_undisturbed(&python.run(&args), &digests);
    // The same request id: the same experiment, shown again.
    assert_undisturbed(&python.run(&args), &digests);
    // The script's options change the file.
    let args = [&args[..3], &["--seed", "8", "--generations", "2"]].concat();
    let changed = python.run(&args);
    assert_eq!(changed.code, Some(0), "{changed:#?}");
    assert!(changed.stdout.starts_with("experiment 2 ("), "{}", changed.stdout);
    assert!(changed.stdout.contains("seed 8\n"), "{}", changed.stdout);
    assert!(changed.stdout.contains("\n2/2  "), "{}", changed.stdout);
}

#[test]
fn a_python_script_survives_the_coordinator_before_and_while_it_follows() {
    let Some(python) = PythonClient::find() else { return };
    let experiment = Experiment::small(6);
    let digests = undisturbed(&experiment);
    let mut coordinator = CoordinatorProcess::start();
    let _worker = WorkerProcess::start(&coordinator, "w");
    coordinator.process.kill();

    let path = experiment.path();
    let mut script = python.start(&[
        path.to_str().unwrap(),
        "--coordinator",
        &coordinator.url(),
        "--patience",
        "120",
    ]);
    script.wait_for_remark("trying again");
    coordinator.restart();
    script.wait_for_line("2/6 ");
    coordinator.process.kill();
    script.wait_for_remark("following on from event");
    coordinator.restart();
    assert_undisturbed(&script.finish(), &digests);
}

#[test]
fn a_python_script_names_every_mistake_in_a_file() {
    let Some(python) = PythonClient::find() else { return };
    let coordinator = CoordinatorProcess::start();
    let experiment = Experiment::small(1).edit(|e| {
        e["algorithm"]["population_sise"] = json!(3);
        e["topology"]["dt"] = json!(-1);
    });
    let path = experiment.path();
    let path = path.to_str().unwrap();
    let outcome = python.run(&[path, "--coordinator", &coordinator.url()]);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    assert_eq!(lines.len(), 2, "{}", outcome.stderr);
    assert!(lines.iter().all(|line| line.starts_with(path)), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("did you mean `population_size`"), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("topology.dt"), "{}", outcome.stderr);

    let missing = python.run(&["missing.json", "--coordinator", &coordinator.url()]);
    assert_eq!(missing.code, Some(2), "{missing:#?}");
    assert_eq!(missing.stderr.lines().count(), 1, "{}", missing.stderr);
    assert!(missing.stderr.contains("missing.json"), "{}", missing.stderr);
}

#[test]
fn a_python_script_needs_the_token_and_says_who_is_not_there() {
    let Some(python) = PythonClient::find() else { return };
    let directory = tempfile::tempdir().unwrap();
    let token_file = |name: &str, token: &str| {
        let path = directory.path().join(name);
        fs::write(&path, token).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let client = token_file("client.token", CLIENT_TOKEN);
    let worker = token_file("worker.token", WORKER_TOKEN);
    let mut coordinator = CoordinatorProcess::start_with(&[
        "--client-token-file",
        &client,
        "--worker-token-file",
        &worker,
    ]);
    let _worker = WorkerProcess::start_with(&coordinator.url(), "w", &["--token-file", &worker]);
    let experiment = Experiment::tiny(1);
    let path = experiment.path();
    let url = coordinator.url();
    let args = [path.to_str().unwrap(), "--coordinator", &url, "--patience", "0"];
    for (options, expected) in
        [(&["--token-file", &*worker][..], "takes the client token"), (&[], "got none")]
    {
        let outcome = python.run(&[&args, options].concat());
        assert_eq!(outcome.code, Some(7), "{outcome:#?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    }
    let with_token = [&args[..], &["--token-file", &client]].concat();
    python.run(&with_token).expect_success();

    coordinator.process.kill();
    let outcome = python.run(&with_token);
    assert_eq!(outcome.code, Some(4), "{outcome:#?}");
    assert!(outcome.stderr.contains(coordinator.address()), "{}", outcome.stderr);
    // On another machine without encryption, the script does not send the token.
    let outcome = python.run(&[&with_token[..], &["--coordinator", "http://192.0.2.1:1"]].concat());
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert!(outcome.stderr.contains("unencrypted"), "{}", outcome.stderr);
}

//! The command line for people: results, errors with the next step, exit codes.

use std::{
    fs,
    io::{BufRead as _, BufReader, Write as _},
    net::TcpListener,
    process::{Command, Stdio},
    thread,
};

use harness::{
    CoordinatorProcess, Experiment, WorkerProcess, run_coordinator, swarmctl, workspace_file,
};
use serde_json::{Value, json};

#[test]
fn quickstart_gets_better_and_gives_the_same_digest_twice() {
    let directory = tempfile::tempdir().unwrap();
    let path = workspace_file("configs/quickstart.json");
    let run = |more: &[&str]| {
        let data_dir = directory.path().to_str().unwrap();
        let args = [&["run", path.to_str().unwrap(), "--data-dir", data_dir], more].concat();
        swarmctl(args).expect_success()
    };
    let first = run(&[]).json_lines();
    let again = run(&[]);
    assert_eq!(again.json_lines(), first, "it is shown again");
    assert!(again.stderr.contains("-> the same once more: --new"), "{}", again.stderr);
    let second = run(&["--new"]).json_lines();
    let last = first.last().unwrap();
    assert_eq!(last["state"], "completed");
    let best = |line: &Value| line["best"].as_f64().unwrap();
    let judged = &last["champion"]["judged"];
    assert_eq!((&judged["trials"], &judged["generation"]), (&json!(200), &json!(59)));
    assert!(judged["ci95"][0].as_f64().unwrap() > best(&first[0]), "{last}");
    let mean = |lines: &[Value]| {
        lines.iter().map(|line| line["mean"].as_f64().unwrap()).sum::<f64>() / lines.len() as f64
    };
    let generations = &first[..first.len() - 1];
    let (start, end) = (&generations[..5], &generations[generations.len() - 5..]);
    assert!(mean(end) > 2.0 * mean(start), "{} {}", mean(start), mean(end));
    assert_eq!(last["digest"], second.last().unwrap()["digest"]);
    assert_ne!(last["experiment"], second.last().unwrap()["experiment"]);
}

#[test]
fn an_interrupted_run_goes_on_with_the_same_command() {
    let directory = tempfile::tempdir().unwrap();
    let data_dir = directory.path().to_str().unwrap();
    let experiment = Experiment::small(6);
    let path = experiment.path();
    let args = ["run", path.to_str().unwrap(), "--workers", "2", "--data-dir", data_dir];

    let mut interrupted = harness::swarmctl_process(args);
    interrupted.wait_for("generation 1", |line| line["generation"] == 1);
    interrupted.signal("INT");
    assert_eq!(interrupted.wait().code(), Some(130));
    let n_done = interrupted.lines().iter().filter(|line| line["generation"].is_u64()).count();
    assert!(n_done < 6, "the interrupt came before the end");
    let list = swarmctl(["list", "--data-dir", data_dir]).expect_success();
    assert!(list.stderr.contains("no program computes it; continue it with"), "{}", list.stderr);

    let continued = swarmctl(args).expect_success().json_lines();
    let elsewhere = tempfile::tempdir().unwrap();
    let args = ["run", path.to_str().unwrap(), "--data-dir", elsewhere.path().to_str().unwrap()];
    let undisturbed = swarmctl(args).expect_success().json_lines();
    assert_eq!(continued.last().unwrap()["digest"], undisturbed.last().unwrap()["digest"]);
    assert_eq!(continued.last().unwrap()["experiment"], 1, "no second experiment was started");
}

#[test]
fn a_long_generation_is_not_silent() {
    let directory = tempfile::tempdir().unwrap();
    let experiment =
        Experiment::small(1).edit(|value| value["algorithm"]["evaluation_steps"] = json!(50_000));
    let mut run = Command::new(harness::binary("swarmctl"));
    run.arg("run").arg(experiment.path()).args(["--workers", "1", "--data-dir"]);
    let mut run = run.arg(directory.path()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(run.stderr.take().unwrap()).lines().map(Result::unwrap);
    let is_progress =
        |line: &String| line.starts_with("generation 0: ") && line.ends_with(" of 36 episodes");
    assert!(lines.any(|line| is_progress(&line)), "it has ended without a word");
    run.kill().unwrap();
    run.wait().unwrap();
}

#[test]
fn a_champion_that_is_judged_once_has_no_interval() {
    let directory = tempfile::tempdir().unwrap();
    let experiment =
        Experiment::tiny(1).edit(|value| value["algorithm"]["judgement_trials"] = json!(1));
    let path = experiment.path();
    let args = ["run", path.to_str().unwrap(), "--data-dir", directory.path().to_str().unwrap()];
    let stderr = swarmctl(args).expect_success().stderr;
    let judged = stderr.lines().find(|line| line.contains("champion judged: ")).unwrap();
    assert!(judged.ends_with(" on 1 trial that selected nothing"), "{judged}");
    assert!(!judged.contains("95 %"), "{judged}");
}

#[test]
fn a_run_whose_output_nobody_reads_goes_on_to_its_champion() {
    let experiment = Experiment::tiny(3);
    for is_stderr_closed in [false, true] {
        let directory = tempfile::tempdir().unwrap();
        let mut run = Command::new(harness::binary("swarmctl"));
        run.arg("run").arg(experiment.path()).args(["--workers", "1", "--data-dir"]);
        run.arg(directory.path()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut run = run.spawn().unwrap();
        drop(run.stdout.take());
        if is_stderr_closed {
            drop(run.stderr.take());
        }
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(is_stderr_closed || stderr.contains("continues without it"), "{stderr}");
        let files = fs::read_dir(directory.path()).unwrap().map(|file| file.unwrap().file_name());
        let is_champion = |name: &std::ffi::OsString| name.to_string_lossy().contains("champion");
        assert!(files.into_iter().any(|name| is_champion(&name)), "{directory:?}");
    }
}

#[test]
fn a_run_ends_early_at_its_target_fitness() {
    let directory = tempfile::tempdir().unwrap();
    let experiment = Experiment::small(50).edit(|e| {
        e["algorithm"]["target_fitness"] = json!(0.0);
    });
    let path = experiment.path();
    let args = ["run", path.to_str().unwrap(), "--data-dir", directory.path().to_str().unwrap()];
    let lines = swarmctl(args).expect_success().json_lines();
    assert_eq!(lines.len(), 2, "the mean of the first generation is not negative");
    let last = lines.last().unwrap();
    assert_eq!(last["state"], "completed");
    assert!(last["reason"].as_str().unwrap().contains("reached the target"), "{last}");
}

#[test]
fn a_bad_file_lists_every_problem_and_creates_nothing() {
    let coordinator = CoordinatorProcess::start();
    let experiment = Experiment::small(1).edit(|e| {
        e["algorithm"]["population_sise"] = json!(3);
        e["algorithm"]["generations"] = json!("many");
        e["world"]["objects"]["robotA"]["num_instances"] = json!(0);
        e["topology"]["synapses"]["H1-H2"]["p"] = json!(1.5);
    });
    let outcome = coordinator.swarmctl(&["submit", experiment.path().to_str().unwrap()]);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    for expected in [
        "population_sise",
        "population_size",
        "algorithm.generations",
        "world.objects.robotA.num_instances",
        "topology.synapses.H1-H2.p",
    ] {
        assert!(outcome.stderr.contains(expected), "{expected} in {}", outcome.stderr);
    }
    assert_eq!(list(&coordinator), Vec::<Value>::new());
}

#[test]
fn broken_json_and_missing_files_are_bad_input() {
    let directory = tempfile::tempdir().unwrap();
    let broken = directory.path().join("broken.json");
    fs::write(&broken, "{\"topology\": ").unwrap();
    let missing = directory.path().join("missing.json");
    for path in [broken, missing] {
        let data_dir = directory.path().join("data");
        let args = ["run", path.to_str().unwrap(), "--data-dir", data_dir.to_str().unwrap()];
        let outcome = swarmctl(args);
        assert_eq!(outcome.code, Some(2), "{outcome:#?}");
        assert!(outcome.stderr.contains(path.file_name().unwrap().to_str().unwrap()));
        assert!(outcome.stdout.is_empty());
    }
}

#[test]
fn unknown_experiments_are_not_found() {
    let coordinator = CoordinatorProcess::start();
    for command in ["watch", "cancel", "champion"] {
        let outcome = coordinator.swarmctl(&[command, "77"]);
        assert_eq!(outcome.code, Some(3), "{outcome:#?}");
        assert!(outcome.stderr.contains("no experiment 77"), "{}", outcome.stderr);
    }
}

#[test]
fn a_coordinator_that_is_not_there_is_named() {
    let outcome = swarmctl(["--coordinator", "http://127.0.0.1:1", "list"]);
    assert_eq!(outcome.code, Some(4), "{outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    for expected in ["127.0.0.1:1", "start one with `coordinator`", "--coordinator"] {
        assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    }
}

#[test]
fn a_wrong_port_is_recognised_by_what_answers_there() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        for mut connection in listener.incoming().map_while(Result::ok) {
            let _ = connection.write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n");
        }
    });
    let outcome = swarmctl(["--coordinator", &format!("http://{address}"), "list"]);
    assert_eq!(outcome.code, Some(9), "{outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    for expected in [&*address.to_string(), "HTTP/1.1 400", "is this the right port?"] {
        assert!(outcome.stderr.contains(expected), "{}", outcome.stderr);
    }
}

#[test]
fn a_worker_waits_for_a_coordinator_that_is_not_up_yet_and_says_so() {
    let mut coordinator = CoordinatorProcess::start();
    coordinator.process.kill();
    let worker = WorkerProcess::start(&coordinator, "early");
    let waiting = worker.process.wait_for("reason", |line| line["reason"].is_string());
    assert!(waiting.to_string().contains(coordinator.address()), "{waiting}");
    coordinator.restart();
    coordinator.process.wait_for("worker", |line| line["message"] == "worker joined");
}

#[test]
fn cancelled_experiments_keep_their_history_and_champion() {
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&Experiment::small(1000).path());
    coordinator.wait_for_generation(1);
    let cancelled = coordinator.swarmctl(&["cancel", &id.to_string()]).expect_success();
    let cancelled: Value = serde_json::from_str(&cancelled.stdout).unwrap();
    assert_eq!(cancelled["state"], "cancelled");
    assert!(cancelled["generations_done"].as_u64().unwrap() >= 2);

    let watched = coordinator.swarmctl(&["watch", &id.to_string()]);
    assert_eq!(watched.code, Some(6), "a watcher learns that it was cancelled");
    let champion = coordinator.swarmctl(&["champion", &id.to_string()]).expect_success();
    let champion: Value = serde_json::from_str(&champion.stdout).unwrap();
    let genotype = champion["genotype"].as_array().unwrap();
    assert!(genotype.len() > 300, "{}", genotype.len());
    assert!(champion["network"]["neurons"].as_array().is_some_and(|n| n.len() == 24));
    assert_eq!(list(&coordinator)[0]["state"], "cancelled");
}

#[test]
fn a_port_in_use_is_one_clear_line() {
    let coordinator = CoordinatorProcess::start();
    let data_dir = tempfile::tempdir().unwrap();
    let outcome = run_coordinator(coordinator.address(), data_dir.path());
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains(coordinator.address()), "{}", outcome.stderr);
}

#[test]
fn an_unusable_data_directory_is_one_clear_line() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("a-file");
    fs::write(&file, "").unwrap();
    let inside_a_file = file.join("data");
    let outcome = run_coordinator("127.0.0.1:0", &inside_a_file);
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert_eq!(outcome.stderr.lines().count(), 1, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("a-file"), "{}", outcome.stderr);
}

#[test]
fn two_coordinators_do_not_share_a_data_directory() {
    let coordinator = CoordinatorProcess::start();
    let outcome = run_coordinator("127.0.0.1:0", coordinator.data_dir());
    assert_eq!(outcome.code, Some(2), "{outcome:#?}");
    assert!(outcome.stderr.contains("in use by another coordinator"), "{}", outcome.stderr);
}

fn list(coordinator: &CoordinatorProcess) -> Vec<Value> {
    let outcome = coordinator.swarmctl(&["list"]).expect_success();
    serde_json::from_str(&outcome.stdout).expect("a JSON list")
}

//! `swarmctl explain` in all situations that it knows: the test follows its advice word by word,
//! and the experiment continues.
//!
//! Other situations are tested beside their causes: a full disk in `faults::disk`, too little
//! memory in `budgets`.

use std::{
    collections::BTreeSet,
    env, fs,
    io::{BufRead as _, BufReader},
    process::{Child, Command, Stdio},
    sync::OnceLock,
    thread,
    time::Duration,
};

use experiment_file::ExperimentConfig;
use harness::{
    CoordinatorProcess, Experiment, HandWorker, Outcome, WorkerProcess, binary, hello,
    trial_set_of, undisturbed,
};
use serde_json::Value;
use swarm_proto::v1::{Hello, ItemFailure, item_result, work_response};

/// More questions than a working coordinator needs.
const N_QUESTIONS_MAX: usize = 600;
/// Time between two questions.
const PERIOD: Duration = Duration::from_millis(100);

fn experiment() -> Experiment {
    Experiment::tiny(2)
}

fn submit(coordinator: &CoordinatorProcess) -> u64 {
    coordinator.submit(&experiment().path())
}

fn assert_undisturbed(coordinator: &CoordinatorProcess, id: u64) {
    static EXPECTED: OnceLock<Vec<String>> = OnceLock::new();
    let expected = EXPECTED.get_or_init(|| undisturbed(&experiment()));
    assert_eq!(coordinator.watch(id).finish().digests(), *expected);
}

/// The findings of `swarmctl explain`.
fn findings(coordinator: &CoordinatorProcess, id: u64) -> Vec<Value> {
    let explanation = coordinator.swarmctl(&["explain", &id.to_string()]).expect_success().json();
    explanation["findings"].as_array().unwrap().clone()
}

/// Asks until the findings satisfy a condition.
fn wait_until<T>(
    coordinator: &CoordinatorProcess,
    id: u64,
    is_met: impl Fn(&[Value]) -> Option<T>,
) -> T {
    let mut found = Vec::new();
    for _ in 0..N_QUESTIONS_MAX {
        found = findings(coordinator, id);
        if let Some(met) = is_met(&found) {
            return met;
        }
        thread::sleep(PERIOD);
    }
    panic!("the last findings are {found:#?}");
}

/// Waits for a finding of a kind whose text contains these words.
fn wait_for_finding(coordinator: &CoordinatorProcess, id: u64, kind: &str, words: &str) -> Value {
    let is_it = |finding: &&Value| {
        finding["kind"] == kind && finding["what"].as_str().unwrap().contains(words)
    };
    wait_until(coordinator, id, |findings| findings.iter().find(is_it).cloned())
}

/// Waits until there is no finding of a kind.
fn wait_for_end_of_finding(coordinator: &CoordinatorProcess, id: u64, kind: &str) {
    let is_gone = |findings: &[Value]| findings.iter().all(|finding| finding["kind"] != kind);
    wait_until(coordinator, id, |findings| is_gone(findings).then_some(()));
}

/// One of the steps that a finding advises.
fn step(finding: &Value, index: usize) -> &str {
    finding["next_steps"][index].as_str().unwrap_or_else(|| panic!("no step {index}: {finding:#}"))
}

/// The command of a step, as a user types it after setting the coordinator's address.
fn typed(coordinator: &CoordinatorProcess, step: &str) -> Command {
    let (_, command) = step.split_once(": ").unwrap();
    let programs = binary("swarmctl").parent().unwrap().to_owned();
    let path = env::var_os("PATH").unwrap();
    let path = env::join_paths([programs].into_iter().chain(env::split_paths(&path))).unwrap();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("exec {command}")]).env("PATH", path);
    shell.env("SWARM_COORDINATOR", coordinator.url());
    shell
}

/// Carries a step out.
fn carry_out(coordinator: &CoordinatorProcess, step: &str) -> Outcome {
    Outcome::of_command(&mut typed(coordinator, step)).expect_success()
}

/// A worker that was started on the advice of a step.
struct AdvisedWorker(Child);

impl AdvisedWorker {
    fn start(coordinator: &CoordinatorProcess, step: &str) -> Self {
        let mut command = typed(coordinator, step);
        Self(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap())
    }
}

impl Drop for AdvisedWorker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

async fn connect(coordinator: &CoordinatorProcess, name: &str) -> HandWorker {
    let hello = Hello { name: name.to_owned(), ..hello() };
    HandWorker::connect(&coordinator.url(), hello).await.unwrap()
}

/// Falsely reports that the first item of a worker fails.
async fn fail(worker: &mut HandWorker) {
    let assignments = worker.receive_assignments().await.unwrap().assignments;
    let failure = ItemFailure { message: "the wheels came off".to_owned() };
    let outcome = item_result::Outcome::Failure(failure);
    worker.answer(assignments[0].assignment_id, outcome).await;
}

/// Computes the first item of a worker.
async fn compute_one(worker: &mut HandWorker) {
    let config = loop {
        if let work_response::Message::Spec(spec) = worker.receive().await.unwrap() {
            break ExperimentConfig::from_json(&spec.config_json, "", evolution::ALGORITHMS);
        }
    };
    let simulation = sim_core::Simulation::compile(&config.unwrap().0).unwrap();
    let batch = worker.receive_assignments().await.unwrap();
    let assignment = &batch.assignments[0];
    let trials = assignment.first_trial..assignment.first_trial + assignment.trial_count;
    let values = simulation.evaluate(&assignment.genotype, trial_set_of(&batch).1, trials);
    worker.answer_fitness(assignment.assignment_id, values.unwrap()).await;
}

fn wait_for_proof(coordinator: &CoordinatorProcess, name: &str) {
    coordinator.process.wait_for("proof", |line| {
        let message = line["message"].as_str().unwrap_or_default();
        message.starts_with("worker is faulty") && line["name"] == name
    });
}

fn send_signal(signal: &str, process: u32) {
    let status = Command::new("kill").args([signal, &process.to_string()]).status().unwrap();
    assert!(status.success());
}

#[test]
fn every_advised_command_for_a_waiting_paused_or_ended_experiment_works() {
    let coordinator = CoordinatorProcess::start();
    let (id, other) = (submit(&coordinator), submit(&coordinator));
    let nobody = wait_for_finding(&coordinator, id, "no_workers", "");
    coordinator.swarmctl(&["pause", &id.to_string()]).expect_success();
    let paused = wait_for_finding(&coordinator, id, "paused", "");
    carry_out(&coordinator, step(&paused, 0));
    coordinator.swarmctl(&["cancel", &other.to_string()]).expect_success();
    let _worker = AdvisedWorker::start(&coordinator, step(&nobody, 0));
    assert_undisturbed(&coordinator, id);
    for id in [id, other] {
        let ended = wait_for_finding(&coordinator, id, "ended", "");
        carry_out(&coordinator, step(&ended, 0));
        carry_out(&coordinator, step(&ended, 1));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_advised_commands_readmit_workers_in_quarantine() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    // One mended worker ends the first experiment, and its findings with it.
    let endless = coordinator.submit(&Experiment::tiny(100_000).path());
    // A shell would split these arguments.
    let names = ["lab 2's", "$(false)"];
    for name in names {
        let mut worker = connect(&coordinator, name).await;
        fail(&mut worker).await;
        wait_for_proof(&coordinator, name);
        worker.hang_up().await;
    }
    // Their machines are repaired.
    let _mended = names.map(|name| WorkerProcess::start(&coordinator, name));
    wait_for_finding(&coordinator, endless, "quarantine", "2 workers");
    let available = wait_for_finding(&coordinator, endless, "no_workers_available", "none of 2");
    let reasons = carry_out(&coordinator, step(&available, 0)).stdout;
    assert_eq!(reasons.matches("the wheels came off").count(), 2, "{reasons}");
    for n_left in ["2 workers", "1 worker "] {
        let quarantine = wait_for_finding(&coordinator, endless, "quarantine", n_left);
        carry_out(&coordinator, step(&quarantine, 1));
    }
    wait_for_end_of_finding(&coordinator, endless, "quarantine");
    assert_undisturbed(&coordinator, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_hangs_is_named_and_may_be_restarted() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut hung = connect(&coordinator, "hung").await;
    hung.receive_assignments().await.unwrap();
    let mut honest = connect(&coordinator, "honest").await;
    compute_one(&mut honest).await;
    let said = "hung: it has returned nothing for";
    let waiting = wait_for_finding(&coordinator, id, "workers_waiting", said);
    assert!(step(&waiting, 1).contains("restart it, which is safe"), "{waiting:#}");
    hung.hang_up().await;
    let _restarted = WorkerProcess::start(&coordinator, "hung");
    wait_for_end_of_finding(&coordinator, id, "workers_waiting");
    honest.hang_up().await;
    assert_undisturbed(&coordinator, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_worker_waits_no_longer_than_stated() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut other = connect(&coordinator, "other").await;
    other.receive_assignments().await.unwrap();
    // It waits for 0.5 s after the first loss, and for twice as long after each other.
    for _ in 0..4 {
        connect(&coordinator, "flapping").await.hang_up().await;
    }
    let _worker = WorkerProcess::start(&coordinator, "flapping");
    let said = "flapping: it was lost, and has returned nothing since";
    let waiting = wait_for_finding(&coordinator, id, "workers_waiting", said);
    assert!(step(&waiting, 0).starts_with("no action is needed"), "{waiting:#}");
    wait_for_end_of_finding(&coordinator, id, "workers_waiting");
    other.hang_up().await;
    assert_undisturbed(&coordinator, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_experiment_that_no_connected_worker_takes_says_so() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let hello = Hello { name: "reserved".to_owned(), experiments: "alice-*".to_owned(), ..hello() };
    let reserved = HandWorker::connect(&coordinator.url(), hello).await.unwrap();
    let finding = wait_for_finding(&coordinator, id, "taken_by_none", "1 worker would be free");
    let workers = carry_out(&coordinator, step(&finding, 0)).stdout;
    assert!(workers.contains("alice-*"), "{workers}");
    let _worker = AdvisedWorker::start(&coordinator, step(&finding, 1));
    wait_for_end_of_finding(&coordinator, id, "taken_by_none");
    assert_undisturbed(&coordinator, id);
    reserved.hang_up().await;
}

/// The process of a coordinator's referee.
fn referee_of(coordinator: &CoordinatorProcess) -> u32 {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let mut ids = processes.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let is_it = |id: &u32| {
        let Ok(stat) = fs::read_to_string(format!("/proc/{id}/stat")) else { return false };
        let Some((_, rest)) = stat.rsplit_once(") ") else { return false };
        rest.split(' ').nth(1) == Some(&coordinator.process.id().to_string())
    };
    ids.find(is_it).expect("the referee is kept for a while")
}

#[tokio::test(flavor = "multi_thread")]
async fn questions_for_the_referee_are_shown_and_need_no_help() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut broken = connect(&coordinator, "broken-1").await;
    fail(&mut broken).await;
    wait_for_proof(&coordinator, "broken-1");
    // The worker is slow from here on.
    let referee = referee_of(&coordinator);
    send_signal("-STOP", referee);
    let mut broken = connect(&coordinator, "broken-2").await;
    fail(&mut broken).await;
    let said = "worker \"broken-2\" reports that it fails: the wheels came off";
    let asked = wait_for_finding(&coordinator, id, "referee", said);
    assert!(asked["next_steps"].as_array().unwrap().is_empty(), "{asked:#}");
    let said = "broken-2: one of its results is in doubt until the referee has answered";
    wait_for_finding(&coordinator, id, "workers_waiting", said);
    // No worker is left, so `explain` advises to start more.
    let available = wait_for_finding(&coordinator, id, "no_workers_available", "");
    let _worker = AdvisedWorker::start(&coordinator, step(&available, 1));
    wait_for_end_of_finding(&coordinator, id, "no_workers_available");
    wait_for_finding(&coordinator, id, "referee", "broken-2");
    send_signal("-CONT", referee);
    assert_undisturbed(&coordinator, id);
}

/// Sets how many open files a process may have.
fn limit_open_files(process: u32, n: u32) {
    let status = Command::new("prlimit")
        .args(["--pid", &process.to_string(), &format!("--nofile={n}:")])
        .status()
        .expect("prlimit is on every Linux");
    assert!(status.success());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_referee_that_cannot_be_started_is_asked_again_once_there_are_enough_open_files() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut broken = connect(&coordinator, "broken").await;
    let process = coordinator.process.id();
    let entries = fs::read_dir(format!("/proc/{process}/fd")).unwrap().flatten();
    let open: BTreeSet<u32> =
        entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect();
    // Enough for one or two clients, but not for the pipes of another process.
    let room = (0..).filter(|n| !open.contains(n)).nth(4).unwrap();
    limit_open_files(process, room);
    fail(&mut broken).await;
    let trouble = wait_for_finding(&coordinator, id, "referee_trouble", "Too many open files");
    assert!(trouble["what"].as_str().unwrap().contains("processes or open files"), "{trouble:#}");
    assert!(step(&trouble, 0).starts_with("fix that on the coordinator's machine"), "{trouble:#}");
    limit_open_files(process, 1024);
    wait_for_end_of_finding(&coordinator, id, "referee_trouble");
    wait_for_proof(&coordinator, "broken");
    let _worker = WorkerProcess::start(&coordinator, "honest");
    assert_undisturbed(&coordinator, id);
}

#[test]
fn audits_that_wait_for_a_second_worker_are_done_when_it_is_started() {
    let coordinator = CoordinatorProcess::start_with(&["--audit-fraction", "1"]);
    let _first = WorkerProcess::start(&coordinator, "first");
    let id = submit(&coordinator);
    let said = "waiting for a worker of another name";
    let audits = wait_for_finding(&coordinator, id, "audits", said);
    let _second = AdvisedWorker::start(&coordinator, step(&audits, 0));
    assert_undisturbed(&coordinator, id);
    let lines = coordinator.process.lines();
    let waived = "there was no second worker to audit results";
    assert!(!lines.iter().any(|line| line["message"] == waived), "none was skipped");
}

#[tokio::test(flavor = "multi_thread")]
async fn individuals_of_lost_workers_are_computed_again_without_help() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut mortal = connect(&coordinator, "mortal").await;
    mortal.receive_assignments().await.unwrap();
    mortal.hang_up().await;
    let failing = wait_for_finding(&coordinator, id, "individuals_failing", "1 individual;");
    assert!(step(&failing, 1).contains("no other action is needed"), "{failing:#}");
    let nobody = wait_for_finding(&coordinator, id, "no_workers", "");
    let _worker = AdvisedWorker::start(&coordinator, step(&nobody, 0));
    wait_for_end_of_finding(&coordinator, id, "individuals_failing");
    assert_undisturbed(&coordinator, id);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_experiment_that_is_queued_beside_another_is_alone_once_that_is_paused() {
    let coordinator = CoordinatorProcess::start();
    let (id, rival) = (submit(&coordinator), submit(&coordinator));
    let mut busy = connect(&coordinator, "busy").await;
    busy.receive_assignments().await.unwrap();
    let queued = wait_for_finding(&coordinator, id, "queued", &format!(": {rival}"));
    let raise = step(&queued, 0);
    carry_out(&coordinator, &raise.replace(" N ", " 200 "));
    let pause = step(&queued, 1);
    carry_out(&coordinator, &pause.replace(" ID ", &format!(" {rival} ")));
    wait_for_end_of_finding(&coordinator, id, "queued");
    busy.hang_up().await;
    let _worker = WorkerProcess::start(&coordinator, "worker");
    assert_undisturbed(&coordinator, id);
}

/// A program that follows an experiment, and its remarks.
fn follow(
    coordinator: &CoordinatorProcess,
    command: &str,
    id: u64,
) -> (Child, impl Iterator<Item = String> + use<>) {
    let mut process = Command::new(binary("swarmctl"));
    process.args(["--coordinator", &coordinator.url(), command, &id.to_string()]);
    let mut process = process.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let remarks = BufReader::new(process.stderr.take().unwrap()).lines().map(Result::unwrap);
    (process, remarks)
}

#[test]
fn watchers_are_told_at_once_why_an_experiment_waits() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    let mut following = ["watch", "wait"].map(|command| follow(&coordinator, command, id));
    for (_, remarks) in &mut following {
        assert_eq!(remarks.next().unwrap(), "waiting: no worker is connected");
        let advice = remarks.next().unwrap();
        assert!(advice.contains("start some: worker --coordinator"), "{advice}");
    }

    let fleet = coordinator.swarmctl(&["explain"]).expect_success().json();
    assert_eq!(fleet["workers"], 0);
    assert_eq!(fleet["experiments"][0]["findings"][0]["kind"], "no_workers");

    coordinator.swarmctl(&["pause", &id.to_string(), "--reason", "lunch"]).expect_success();
    for (_, remarks) in &mut following {
        assert_eq!(remarks.next().unwrap(), "waiting: it is paused: paused by a client: lunch");
    }
    coordinator.swarmctl(&["resume", &id.to_string()]).expect_success();
    let _worker = WorkerProcess::start(&coordinator, "ada");
    for (mut process, remarks) in following {
        drop(remarks.last());
        assert!(process.wait().unwrap().success());
    }
}

#[test]
fn an_interrupted_watcher_is_told_that_no_experiment_changes() {
    let coordinator = CoordinatorProcess::start();
    let id = submit(&coordinator);
    for command in ["watch", "wait"] {
        let (mut process, mut remarks) = follow(&coordinator, command, id);
        assert_eq!(remarks.next().unwrap(), "waiting: no worker is connected");
        let interrupt = Command::new("kill").args(["-INT", &process.id().to_string()]).status();
        assert!(interrupt.unwrap().success());
        assert_eq!(remarks.last().unwrap(), "interrupted; this command changes no experiment");
        assert_eq!(process.wait().unwrap().code(), Some(130));
    }
}

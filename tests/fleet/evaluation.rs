//! Evaluations write the same files on any fleet, with any faults.

use std::{collections::BTreeMap, fs, path::Path, process::Command, thread, time::Duration};

use harness::{
    CoordinatorProcess, Experiment, HandWorker, Outcome, WorkerProcess, binary, hello, swarmctl,
    swarmctl_process,
};
use serde_json::{Value, json};
use swarm_proto::v1::{
    EvaluateRequest, EvaluateResponse, Hello, TrialFitness, TrialMeasures,
    evaluate_response::Message, evaluation_service_client::EvaluationServiceClient,
    item_result::Outcome as Answer, work_response,
};
use tempfile::TempDir;
use tonic::{Code, Status, transport::Channel};

const FILES: [&str; 3] = ["steps.csv", "summary.json", "trials.csv"];

/// A genotype and its experiment, in files.
struct Subject {
    experiment: Experiment,
    directory: TempDir,
}

impl Subject {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let experiment = Experiment::tiny(1);
        let n_genes = compiled(&experiment.text()).genotype_len();
        let genes: Vec<f64> = (0..n_genes).map(|i| (i * 7 % 11) as f64 / 10.0).collect();
        fs::write(directory.path().join("genotype.json"), json!(genes).to_string()).unwrap();
        Self { experiment, directory }
    }

    fn genotype(&self) -> Vec<f64> {
        let text = fs::read_to_string(self.directory.path().join("genotype.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    }

    /// The arguments of an evaluation into a directory of its own.
    fn args(&self, to: &str, more: &[&str]) -> Vec<String> {
        let path = |path: &Path| path.to_str().unwrap().to_owned();
        let mut args: Vec<String> = ["evaluate", "--trials", "12", "--steps", "300", "--genotype"]
            .map(str::to_owned)
            .into();
        args.push(path(&self.directory.path().join("genotype.json")));
        args.extend(["--config".to_owned(), path(&self.experiment.path())]);
        args.extend(["--to".to_owned(), path(&self.directory.path().join(to))]);
        args.extend(more.iter().map(|&arg| arg.to_owned()));
        args
    }

    /// The written files.
    fn files(&self, to: &str) -> BTreeMap<&'static str, String> {
        let read = |name| (name, fs::read_to_string(self.directory.path().join(to).join(name)));
        FILES.into_iter().map(read).map(|(name, text)| (name, text.unwrap())).collect()
    }

    fn request(&self) -> EvaluateRequest {
        EvaluateRequest {
            config_json: self.experiment.text(),
            genotype: self.genotype(),
            trial_count: 3,
            priority: None,
        }
    }
}

fn compiled(config_json: &str) -> sim_core::Simulation {
    let (config, _) =
        experiment_file::ExperimentConfig::from_json(config_json, "", evolution::ALGORITHMS)
            .unwrap();
    sim_core::Simulation::compile(&config).unwrap()
}

const CONDITIONS: [&str; 6] =
    ["--robots", "5,15", "--perturb", "topology_switch:every=100", "--inhibit", "msg"];

fn evaluate(coordinator: &CoordinatorProcess, args: &[String]) -> Outcome {
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    coordinator.swarmctl(&args)
}

#[test]
fn one_process_one_worker_and_workers_that_are_killed_give_the_same_files() {
    let subject = Subject::new();
    let local = subject.args("local", &[&["--local", "--workers", "2"][..], &CONDITIONS].concat());
    swarmctl(&local).expect_success();
    let files = subject.files("local");

    let coordinator = CoordinatorProcess::start();
    let _worker = WorkerProcess::start(&coordinator, "alone");
    evaluate(&coordinator, &subject.args("alone", &CONDITIONS)).expect_success();
    assert_eq!(subject.files("alone"), files);

    let coordinator = CoordinatorProcess::start();
    let mut workers = WorkerProcess::start_many(&coordinator, 3);
    let args = subject.args("killed", &CONDITIONS);
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    thread::scope(|scope| {
        let evaluating = scope.spawn(|| coordinator.swarmctl(&args).expect_success());
        for worker in &mut workers[..2] {
            let (_, assigned) = coordinator
                .process
                .find(0, "an assignment", |line| line["message"] == "items assigned");
            assert_eq!(assigned["trials"], "evaluation", "{assigned}");
            worker.process.kill();
            coordinator.process.wait_for("loss", |line| {
                line["message"] == "worker lost" && line["name"] == *worker.name
            });
        }
        evaluating.join().unwrap();
    });
    assert_eq!(subject.files("killed"), files);
}

#[test]
fn a_coordinator_that_is_killed_is_asked_again() {
    let subject = Subject::new();
    swarmctl(subject.args("local", &["--local"])).expect_success();
    let mut coordinator = CoordinatorProcess::start();
    let args = subject.args("killed", &[]);
    let url = coordinator.url();
    thread::scope(|scope| {
        let args = ["--coordinator", &url].into_iter().map(str::to_owned).chain(args);
        let evaluating = scope.spawn(|| swarmctl(args).expect_success());
        // Without a worker, the evaluation cannot finish.
        coordinator.process.wait_for("evaluation", |line| line["message"] == "evaluation starts");
        coordinator.process.kill();
        coordinator.restart();
        let _worker = WorkerProcess::start(&coordinator, "late");
        evaluating.join().unwrap();
    });
    assert_eq!(subject.files("killed"), subject.files("local"));
}

#[test]
fn a_champion_is_evaluated_with_the_experiment_that_it_comes_from() {
    let subject = Subject::new();
    let coordinator = CoordinatorProcess::start();
    let _workers = WorkerProcess::start_many(&coordinator, 2);
    let id = coordinator.submit(&subject.experiment.path());
    coordinator.watch(id).finish();
    let champion = coordinator.swarmctl(&["champion", &id.to_string()]).expect_success().json();
    let path = subject.directory.path().join("genotype.json");
    fs::write(path, champion["genotype"].to_string()).unwrap();
    let to = |to: &str| subject.directory.path().join(to).to_str().unwrap().to_owned();
    let by_id =
        ["evaluate", &id.to_string(), "--trials", "12", "--steps", "300", "--to", &to("by_id")];
    coordinator.swarmctl(&by_id).expect_success();
    swarmctl(subject.args("by_file", &["--local"])).expect_success();
    let summaries = ["by_id", "by_file"].map(|to| {
        let text = subject.files(to).remove("summary.json").unwrap();
        serde_json::from_str::<Value>(&text).unwrap()
    });
    assert_eq!(summaries[0], summaries[1]);
    assert_eq!(subject.files("by_id")["steps.csv"], subject.files("by_file")["steps.csv"]);
}

#[test]
fn the_files_agree_with_each_other() {
    let subject = Subject::new();
    let more = ["--local", "--every", "100", "--robots", "1"];
    swarmctl(subject.args("out", &more)).expect_success();
    let files = subject.files("out");
    let summary: Value = serde_json::from_str(&files["summary.json"]).unwrap();
    let steps: Vec<Vec<&str>> =
        files["steps.csv"].lines().skip(1).map(|line| line.split(',').collect()).collect();
    let trials: Vec<Vec<&str>> =
        files["trials.csv"].lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(steps.len(), 2 * 2 * 4, "conditions, measures, and steps 0, 100, 200, 299");
    assert_eq!(trials.len(), 2 * 12 * 3, "conditions, trials, and fitness beside the measures");
    for (condition, name) in ["nominal", "robots=1"].into_iter().enumerate() {
        let condition = &summary["conditions"][condition];
        assert_eq!(condition["name"], name);
        for metric in ["leaders", "one_leader"] {
            let estimate = &condition["metrics"][metric];
            let mean_of = |column: usize| {
                let rows = trials.iter().filter(|row| row[0] == name && row[2] == metric);
                let values: Vec<f64> = rows.map(|row| row[column].parse().unwrap()).collect();
                assert_eq!(values.len(), 12);
                values.iter().sum::<f64>() / 12.0
            };
            assert!((estimate["time_mean"]["mean"].as_f64().unwrap() - mean_of(3)).abs() < 1e-9);
            assert!((estimate["end"]["mean"].as_f64().unwrap() - mean_of(4)).abs() < 1e-9);
            let last = steps.iter().find(|row| row[..3] == [name, "299", metric]).unwrap();
            assert!((last[7].parse::<f64>().unwrap() - mean_of(4)).abs() < 1e-5);
        }
    }
}

#[test]
fn unknown_names_are_refused_in_one_line_with_the_known_ones() {
    let subject = Subject::new();
    for (args, expected) in [
        (["--inhibit", "msgs"], "did you mean `msg`?"),
        (["--inhibit", "xyz"], "known: "),
        (["--perturb", "leader_failur"], "did you mean `leader_failure`?"),
        (["--perturb", "leader_failure:time=3"], "time_to_failure"),
        (["--perturb", "leader_failure:3"], "expected KEY=VALUE"),
        (["--set", "world.hight=3"], "did you mean `height`?"),
        (["--set", "world"], "expected PATH=VALUE"),
        (["--robots", "0"], "num_instances"),
    ] {
        let outcome = swarmctl(subject.args("out", &[&args[..], &["--local"]].concat()));
        assert_eq!(outcome.code, Some(2), "{args:?}: {}", outcome.stderr);
        assert!(outcome.stderr.contains(expected), "{args:?}: {}", outcome.stderr);
        assert_eq!(outcome.stderr.trim_end().lines().count(), 1, "{}", outcome.stderr);
    }
    assert!(!subject.directory.path().join("out").exists(), "nothing was begun");
}

async fn ask(
    coordinator: &CoordinatorProcess,
    request: EvaluateRequest,
) -> Result<Vec<Message>, Status> {
    let mut client: EvaluationServiceClient<Channel> =
        EvaluationServiceClient::connect(coordinator.url()).await.unwrap();
    let mut answers = client.evaluate(request).await?.into_inner();
    let mut messages = Vec::new();
    while let Some(EvaluateResponse { message }) = answers.message().await? {
        messages.extend(message);
    }
    Ok(messages)
}

#[tokio::test]
async fn requests_that_cannot_be_computed_are_refused_at_once() {
    let coordinator = CoordinatorProcess::start();
    let good = Subject::new().request();
    let short = good.genotype[1..].to_vec();
    let mut many_steps: Value = serde_json::from_str(&good.config_json).unwrap();
    many_steps["algorithm"]["evaluation_steps"] = json!(100_000);
    for (request, expected) in [
        (EvaluateRequest { config_json: "{}".to_owned(), ..good.clone() }, "missing key"),
        (EvaluateRequest { genotype: short, ..good.clone() }, "genes, the experiment's have"),
        (
            EvaluateRequest { genotype: vec![f64::NAN; good.genotype.len()], ..good.clone() },
            "gene 0",
        ),
        (EvaluateRequest { trial_count: 0, ..good.clone() }, "trial_count is 0"),
        (EvaluateRequest { trial_count: 1001, ..good.clone() }, "trial_count is 1001"),
        (EvaluateRequest { priority: Some(0), ..good.clone() }, "priority"),
        (
            EvaluateRequest {
                config_json: many_steps.to_string(),
                trial_count: 1000,
                ..good.clone()
            },
            "fewer steps or trials",
        ),
    ] {
        let status = ask(&coordinator, request).await.unwrap_err();
        assert_eq!(status.code(), Code::InvalidArgument, "{status}");
        assert!(status.message().contains(expected), "{status}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_of_the_wrong_size_are_refused_and_others_compute() {
    let coordinator = CoordinatorProcess::start();
    let subject = Subject::new();
    let request = subject.request();
    let n_values = 1 + 250 * 2;
    let url = coordinator.url();
    let asking = {
        let request = request.clone();
        let url = url.clone();
        tokio::spawn(async move {
            let mut client = EvaluationServiceClient::connect(url).await.unwrap();
            let mut answers = client.evaluate(request).await.unwrap().into_inner();
            let mut trials = Vec::new();
            while let Some(answer) = answers.message().await.unwrap() {
                if let Some(Message::Trial(trial)) = answer.message {
                    trials.push(trial);
                }
            }
            trials
        })
    };
    for (wrong, expected) in [
        (Answer::Measures(TrialMeasures { values: vec![0.5; n_values - 1] }), "values for"),
        (
            Answer::Fitness(TrialFitness { values: vec![0.5; 3 * n_values] }),
            "it returned fitness where measures are due",
        ),
    ] {
        let hello = Hello { name: expected.to_owned(), ..hello() };
        let mut worker = HandWorker::connect(&url, hello).await.unwrap();
        let batch = worker.receive_assignments().await.unwrap();
        assert_eq!(batch.output(), swarm_proto::v1::Output::Measures);
        worker.answer(batch.assignments[0].assignment_id, wrong).await;
        coordinator.process.wait_for("quarantine", |line| {
            line["level"] == "ERROR"
                && line["name"] == expected
                && line["reason"].as_str().is_some_and(|reason| reason.contains(expected))
        });
    }
    let _worker = WorkerProcess::start(&coordinator, "good");
    let trials = asking.await.unwrap();
    let experiment = compiled(&request.config_json);
    let fitness =
        experiment.evaluate(&request.genotype, sim_core::TrialSet::Evaluation, 0..3).unwrap();
    assert_eq!(trials.iter().map(|trial| trial.fitness).collect::<Vec<_>>(), fitness);
    assert!(trials.iter().all(|trial| trial.values.len() == n_values - 1));
}

#[tokio::test]
async fn the_work_of_a_client_that_goes_away_is_dropped() {
    let coordinator = CoordinatorProcess::start();
    let mut client = EvaluationServiceClient::connect(coordinator.url()).await.unwrap();
    let mut answers = client.evaluate(Subject::new().request()).await.unwrap().into_inner();
    answers.message().await.unwrap();
    let mut worker = HandWorker::connect(&coordinator.url(), hello()).await.unwrap();
    let batch = worker.receive_assignments().await.unwrap();
    drop(answers);
    loop {
        if let work_response::Message::EndJob(end) = worker.receive().await.unwrap() {
            assert_eq!(end.job, batch.job);
            break;
        }
    }
}

/// The text output, for people.
fn shown(coordinator: &CoordinatorProcess, command: &str) -> Outcome {
    let mut process = Command::new(binary("swarmctl"));
    process.args([command, "--coordinator", &coordinator.url()]);
    Outcome::of_command(&mut process).expect_success()
}

#[test]
fn an_evaluation_that_waits_for_a_worker_is_seen_by_everybody() {
    /// More questions than a working coordinator needs.
    const N_QUESTIONS_MAX: usize = 600;
    let subject = Subject::new();
    let coordinator = CoordinatorProcess::start();
    let url = coordinator.url();
    let mut args = vec!["--coordinator".to_owned(), url.clone()];
    args.extend(subject.args("waits", &[]));
    let mut evaluation = swarmctl_process(&args);
    let explained = (0..N_QUESTIONS_MAX).find_map(|_| {
        let fleet = coordinator.swarmctl(&["explain"]).expect_success().json();
        thread::sleep(Duration::from_millis(100));
        fleet["evaluations"].get(0).cloned()
    });
    let explained = explained.expect("the evaluation is seen");
    assert_eq!((&explained["episodes"], &explained["episodes_left"]), (&json!(12), &json!(12)));
    assert_eq!(explained["workers_available"], 0);
    let said = shown(&coordinator, "explain").stdout;
    let start = format!("no worker is connected\n  -> start some: worker --coordinator {url}\n");
    assert!(said.contains(": 0 of 12 episodes done in ") && said.contains(&start), "{said}");
    for command in ["list", "workers"] {
        let said = shown(&coordinator, command).stderr;
        assert!(said.contains("1 evaluation is not done"), "{said}");
    }
    let _worker = WorkerProcess::start(&coordinator, "w");
    assert!(evaluation.wait().success());
    let fleet = coordinator.swarmctl(&["explain"]).expect_success().json();
    assert_eq!(fleet["evaluations"], json!([]));
}

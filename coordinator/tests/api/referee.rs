//! The referee's verdicts, and its behaviour when an item, or something else, takes its process
//! down.

use std::{
    ffi::OsString,
    fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Output as Ended, Stdio},
    time::Duration,
};

use coordinator::referee::{Referee, RefereeProgram};
use engine::{RefereeRequest, Verdict};
use experiment_file::{DescriptorConfig, ExperimentConfig, Summarises};
use sim_core::{Output, Simulation, TrialSet};
use tempfile::TempDir;
use tokio::time::{sleep, timeout};

const COORDINATOR: &str = env!("CARGO_BIN_EXE_coordinator");
/// A long idle time, which no test reaches.
const LONG: Duration = Duration::from_secs(600);
/// A deadline that only a hanging referee misses.
const DEADLINE: Duration = Duration::from_secs(60);

/// The quickstart, with changes.
fn config(change: impl FnOnce(&mut ExperimentConfig)) -> ExperimentConfig {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
    let (mut config, _) = ExperimentConfig::from_json(
        &fs::read_to_string(path).unwrap(),
        "quickstart",
        evolution::ALGORITHMS,
    )
    .unwrap();
    change(&mut config);
    config
}

fn request(config: &ExperimentConfig) -> RefereeRequest {
    let n_genes = Simulation::compile(config).unwrap().genotype_len();
    RefereeRequest {
        specification: config.to_canonical_json().into(),
        genotype: (0..n_genes).map(|i| (i * 37 % 101) as f64 / 101.0).collect::<Vec<_>>().into(),
        trial_set: TrialSet::Generation(3),
        trials: 1..3,
        output: Output::Fitness,
    }
}

/// An item that takes milliseconds.
fn short() -> RefereeRequest {
    request(&config(|_| {}))
}

/// An item that takes longer than any test.
fn endless() -> RefereeRequest {
    let endless = config(|config| config.algorithm.evaluation_steps = 100_000);
    RefereeRequest { trials: 0..1000, ..request(&endless) }
}

fn coordinator() -> RefereeProgram {
    RefereeProgram { path: COORDINATOR.into(), args: vec!["referee".into()] }
}

/// A referee program that is a line of shell, in which `$0` is the coordinator's program.
fn shell(line: &str) -> RefereeProgram {
    let args = ["-c", line, COORDINATOR].map(OsString::from);
    RefereeProgram { path: "/bin/sh".into(), args: args.into() }
}

/// A referee that writes down the id of its process.
struct Traced {
    referee: Referee,
    directory: TempDir,
}

impl Traced {
    fn new(idle_time: Duration) -> Self {
        let directory = tempfile::tempdir().unwrap();
        // Under `nohup`, and behind `&`, tests and their child processes would ignore signals.
        let line = format!(
            "echo $$ > {}; exec env --default-signal $0 referee",
            pid_file(directory.path()).display()
        );
        Self { referee: Referee::new(shell(&line), idle_time), directory }
    }

    fn process_id(&self) -> Option<u32> {
        let written = fs::read_to_string(pid_file(self.directory.path())).ok()?;
        written.trim().parse().ok()
    }

    /// Waits until the process computes, and returns its id.
    async fn computing(&self) -> u32 {
        until(|| self.process_id().filter(|&id| processor_time(id).is_some_and(|t| t > 20))).await
    }
}

fn pid_file(directory: &Path) -> PathBuf {
    directory.join("pid")
}

/// Processor time of a process, in hundredths of a second; none if it has ended.
fn processor_time(id: u32) -> Option<u64> {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
    let fields: Vec<&str> = stat.rsplit_once(") ")?.1.split(' ').collect();
    (fields[0] != "Z").then(|| fields[11].parse().unwrap())
}

async fn until<T>(mut condition: impl FnMut() -> Option<T>) -> T {
    let waiting = async {
        loop {
            if let Some(value) = condition() {
                return value;
            }
            sleep(Duration::from_millis(5)).await;
        }
    };
    timeout(DEADLINE, waiting).await.expect("it does not take so long")
}

async fn until_ended(id: u32) {
    until(|| processor_time(id).is_none().then_some(())).await;
}

fn send_signal(signal: &str, id: u32) {
    let status = Command::new("kill").args([signal, &id.to_string()]).status().unwrap();
    assert!(status.success());
}

/// Runs the process alone, with this standard input.
fn run_process(input: &[u8]) -> Ended {
    let mut child = Command::new(COORDINATOR)
        .arg("referee")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

#[tokio::test]
async fn values_are_those_of_the_simulation_to_the_bit() {
    let referee = Referee::new(coordinator(), LONG);
    // These are more experiments than the process keeps compiled. When they come again, it still
    // has some of them.
    for seed in [0, 1, 2, 3, 4, 5, 0, 5, 3, 4, 1, 1] {
        let config = config(|config| {
            config.seed = seed;
            config.algorithm.descriptors = vec![DescriptorConfig {
                measure: "leaders".to_owned(),
                summarises: Summarises::Mean,
                range: [0.0, 5.0],
                cells: 5,
            }];
        });
        let simulation = Simulation::compile(&config).unwrap();
        for trial_set in [
            TrialSet::Generation(3),
            TrialSet::HeldOut { generation: 3, block: 1 },
            TrialSet::Judgement(3),
            TrialSet::Evaluation,
        ] {
            for output in [Output::Fitness, Output::Measures, Output::Descriptors] {
                let request = RefereeRequest { trial_set, output, ..request(&config) };
                let RefereeRequest { genotype, trials, .. } = request.clone();
                let expected = match output {
                    Output::Fitness => simulation.evaluate(&genotype, trial_set, trials),
                    Output::Measures => simulation
                        .measure_while(&genotype, trial_set, trials, &|| true)
                        .map(Option::unwrap),
                    Output::Descriptors => simulation
                        .describe_while(&genotype, trial_set, trials, &|| true)
                        .map(Option::unwrap),
                };
                let Verdict::Values(values) = referee.evaluate(&request).await else {
                    panic!("{request:?} has values");
                };
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&values), bits(&expected.unwrap()), "{trial_set:?} {output:?}");
            }
        }
    }
    let stats = referee.stats();
    assert_eq!((stats.n_values, stats.n_unavailable), (12 * 4 * 3, 0));
    assert!(stats.busy > Duration::ZERO);
}

#[tokio::test]
async fn failures_have_the_simulations_messages() {
    let referee = Referee::new(coordinator(), LONG);
    let failure = async |request: RefereeRequest| match referee.evaluate(&request).await {
        Verdict::Failed(failure) => failure,
        other => panic!("{other:?}"),
    };
    let genotype = vec![0.5; 3].into();
    assert_eq!(
        failure(RefereeRequest { genotype, ..short() }).await,
        "the genotype has 3 genes, the experiment's have 424"
    );
    let mut genotype = short().genotype.to_vec();
    genotype[7] = f64::NAN;
    let genotype = genotype.into();
    let outside = "gene 7 is NaN, outside [0, 1]";
    assert_eq!(failure(RefereeRequest { genotype, ..short() }).await, outside);
    let none = "trials 5..5 are not within 0..1000";
    assert_eq!(failure(RefereeRequest { trials: 5..5, ..short() }).await, none);
    for _ in 0..2 {
        let invalid = failure(RefereeRequest { specification: "{}".into(), ..short() }).await;
        let start = "the experiment's specification is not valid: ";
        assert!(invalid.starts_with(start), "{invalid}");
    }
    assert!(matches!(referee.evaluate(&short()).await, Verdict::Values(_)));
    assert_eq!(referee.stats().n_failed, 5);
}

#[tokio::test]
async fn a_process_that_is_killed_while_it_computes_has_died_and_the_next_item_is_computed() {
    let traced = Traced::new(LONG);
    assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
    let item = endless();
    // A process that had another item before may have died of something else, so a new one tries.
    // If that dies, too, the item is to blame.
    let (verdict, id) = tokio::join!(traced.referee.evaluate(&item), async {
        let first = traced.computing().await;
        send_signal("-KILL", first);
        until_ended(first).await;
        let second = traced.computing().await;
        send_signal("-KILL", second);
        assert_ne!(first, second);
        second
    });
    let words = "took the process that computed it down (signal: 9 (SIGKILL))";
    assert_eq!(verdict, Verdict::Died(words.into()));
    assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
    assert_ne!(traced.process_id(), Some(id));
    assert_eq!(traced.referee.stats().n_died, 1);
}

#[tokio::test]
async fn an_item_that_takes_every_process_down_has_that_verdict_and_others_have_values() {
    // Poison: the system kills any process that computes for longer than a second.
    let referee = Referee::new(shell("ulimit -t 1; exec $0 referee"), LONG);
    let poison = endless();
    for _ in 0..2 {
        let verdict = referee.evaluate(&poison).await;
        assert!(matches!(&verdict, Verdict::Died(how) if how.contains("signal")), "{verdict:?}");
        assert!(matches!(referee.evaluate(&short()).await, Verdict::Values(_)));
    }
}

#[tokio::test]
async fn an_item_is_not_to_blame_for_a_process_that_is_told_to_stop_or_dies_without_one() {
    let traced = Traced::new(LONG);
    assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
    let id = traced.process_id().unwrap();
    send_signal("-KILL", id);
    until_ended(id).await;
    assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
    for signal in ["-TERM", "-INT", "-HUP"] {
        let item = endless();
        let (verdict, ()) = tokio::join!(traced.referee.evaluate(&item), async {
            send_signal(signal, traced.computing().await);
        });
        assert!(
            matches!(&verdict, Verdict::Unavailable(why) if why.contains("told to stop")),
            "{verdict:?}"
        );
        // Otherwise the test would take this process for the next one.
        fs::remove_file(pid_file(traced.directory.path())).unwrap();
    }
}

#[tokio::test]
async fn a_process_without_items_ends_after_its_time() {
    let traced = Traced::new(Duration::from_millis(300));
    let mut ids = Vec::new();
    for _ in 0..2 {
        // These items come within its idle time.
        for _ in 0..3 {
            assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
            ids.push(traced.process_id().unwrap());
            sleep(Duration::from_millis(10)).await;
        }
        until_ended(*ids.last().unwrap()).await;
    }
    ids.dedup();
    assert_eq!(ids.len(), 2, "{ids:?}");
}

#[tokio::test]
async fn a_caller_that_stops_waiting_ends_the_computation() {
    let traced = Traced::new(LONG);
    let item = endless();
    let id = tokio::select! {
        verdict = traced.referee.evaluate(&item) => panic!("{verdict:?}"),
        id = traced.computing() => id,
    };
    until_ended(id).await;
    assert!(matches!(traced.referee.evaluate(&short()).await, Verdict::Values(_)));
    let Traced { referee, directory } = traced;
    let id = fs::read_to_string(pid_file(directory.path())).unwrap().trim().parse().unwrap();
    assert!(processor_time(id).is_some(), "it waits for items");
    drop(referee);
    until_ended(id).await;
}

#[tokio::test]
async fn a_process_whose_coordinator_vanishes_stops_computing() {
    // For the process, the end of its standard input is the end of its coordinator.
    let directory = tempfile::tempdir().unwrap();
    let file = pid_file(directory.path());
    let line = format!("timeout 1 cat | {{ $0 referee; echo $? > {}; }}", file.display());
    let referee = Referee::new(shell(&line), LONG);
    let verdict = timeout(DEADLINE, referee.evaluate(&endless())).await.expect("it stops");
    assert!(matches!(verdict, Verdict::Unavailable(_)), "{verdict:?}");
    assert_eq!(fs::read_to_string(file).unwrap().trim(), "0", "its exit code");
}

#[tokio::test]
async fn items_wait_for_each_other() {
    let referee = Referee::new(coordinator(), LONG);
    let items: Vec<_> = (0..10)
        .map(|generation| {
            let trial_set = TrialSet::Generation(generation);
            (referee.clone(), RefereeRequest { trial_set, ..short() })
        })
        .map(|(referee, item)| tokio::spawn(async move { referee.evaluate(&item).await }))
        .collect();
    let simulation = Simulation::compile(&config(|_| {})).unwrap();
    for (generation, item) in (0..).zip(items) {
        let expected =
            simulation.evaluate(&short().genotype, TrialSet::Generation(generation), 1..3).unwrap();
        assert_eq!(item.await.unwrap(), Verdict::Values(expected));
    }
}

#[tokio::test]
async fn programs_that_are_no_referee_are_unavailable_with_a_reason() {
    let missing = RefereeProgram { path: "/nowhere/coordinator".into(), args: Vec::new() };
    // A message of 9 bytes: a `Hello` of 7 with the simulation "other".
    let other = shell(r"printf '\011\012\007\022\005other'; cat > /dev/null");
    for (program, expected) in [
        (missing, "cannot be started (No such file or directory"),
        (shell("exit 3"), "ended before it was ready (exit status: 3)"),
        (shell("echo running 3 tests"), "does not answer like a referee"),
        (other, "simulates with \"other\""),
    ] {
        let referee = Referee::new(program, LONG);
        for _ in 0..2 {
            match referee.evaluate(&short()).await {
                Verdict::Unavailable(reason) => {
                    assert!(reason.contains(expected), "{reason}");
                    assert!(reason.contains("start the coordinator again"), "{reason}");
                }
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(referee.stats().n_unavailable, 2);
    }
}

#[test]
fn the_process_ends_with_its_input_and_with_an_error_if_that_is_garbage() {
    let ended = run_process(b"");
    assert_eq!((ended.status.code(), &*ended.stderr), (Some(0), &b""[..]));
    for garbage in [&b"GET / HTTP/1.1\r\n\r\n"[..], &[1, 0], &[255; 100]] {
        let ended = run_process(garbage);
        assert_eq!(ended.status.code(), Some(1), "{garbage:?}");
        assert!(ended.stderr.starts_with(b"error: "), "{ended:?}");
    }
}

//! For a while, random faults kill, freeze, cut off and block all parts of a fleet, beside
//! workers that lie, fail and hang. Every experiment still ends with the digest of an undisturbed
//! run.
//!
//! `SWARM_SOAK_SECONDS` sets the duration, and `SWARM_SOAK_SEED` repeats the choices of a run
//! (though not its timing).
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::{
    collections::BTreeMap,
    env, fs,
    hash::{BuildHasher as _, Hasher as _, RandomState},
    io::{self, Write as _},
    process::Command,
    str::FromStr,
    thread,
    time::{Duration, Instant},
};

use harness::{
    CoordinatorProcess, Direction, Experiment, HandWorker, Proxy, Watch, WorkerProcess, hello,
    undisturbed,
};
use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng as _, SeedableRng as _},
};
use swarm_proto::v1::{
    Heartbeat, Hello, ItemFailure, TrialFitness, item_result::Outcome, work_request::Message,
    work_response,
};
use tokio::{runtime::Runtime, task::JoinHandle};

const DEFAULT_SECONDS: u64 = 3;
const GENERATIONS: u64 = 20;
const N_WORKERS: usize = 4;
/// Short, so that some pauses are longer than the lease, and some shorter.
const LEASE: &str = "1";
const PAUSE_MS_MAX: u64 = 400;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    WorkerKilled,
    WorkerStopped,
    WorkerFrozen,
    NetworkCut,
    NetworkSilent,
    NetworkDeaf,
    NetworkDead,
    CoordinatorKilled,
    CoordinatorStopped,
    CoordinatorFrozen,
    DatabaseBlocked,
    RefereeKilled,
    LiarJoined,
    FailureJoined,
    HungJoined,
}

const FAULTS: [Fault; 15] = [
    Fault::WorkerKilled,
    Fault::WorkerStopped,
    Fault::WorkerFrozen,
    Fault::NetworkCut,
    Fault::NetworkSilent,
    Fault::NetworkDeaf,
    Fault::NetworkDead,
    Fault::CoordinatorKilled,
    Fault::CoordinatorStopped,
    Fault::CoordinatorFrozen,
    Fault::DatabaseBlocked,
    Fault::RefereeKilled,
    Fault::LiarJoined,
    Fault::FailureJoined,
    Fault::HungJoined,
];

/// A worker behind a network of its own.
struct Place {
    network: Proxy,
    worker: WorkerProcess,
    is_troubled: bool,
}

impl Place {
    fn heal(&mut self) {
        self.worker.process.signal("CONT");
        self.network.heal();
        self.is_troubled = false;
    }
}

struct Soak {
    random: ChaCha8Rng,
    coordinator: CoordinatorProcess,
    places: Vec<Place>,
    n_workers_started: usize,
    /// The runtime of workers that are not processes.
    runtime: Runtime,
    /// The latest bad worker of each kind; a new one replaces the previous one.
    intruders: BTreeMap<Fault, JoinHandle<()>>,
    experiment: Experiment,
    expected: Vec<String>,
    watch: Watch,
    n_completed: usize,
    faults: BTreeMap<Fault, usize>,
}

impl Soak {
    fn start(seed: u64) -> Self {
        let experiment = Experiment::tiny(GENERATIONS);
        let expected = undisturbed(&experiment);
        let coordinator =
            CoordinatorProcess::start_with(&["--lease", LEASE, "--audit-fraction", "1"]);
        let places = (0..N_WORKERS)
            .map(|i| {
                let network = Proxy::start(coordinator.address());
                let worker = WorkerProcess::start_with(&network.url(), &format!("worker-{i}"), &[]);
                Place { network, worker, is_troubled: false }
            })
            .collect();
        let watch = watch(&coordinator, &experiment);
        Self {
            random: ChaCha8Rng::seed_from_u64(seed),
            coordinator,
            places,
            n_workers_started: N_WORKERS,
            runtime: Runtime::new().unwrap(),
            intruders: BTreeMap::new(),
            experiment,
            expected,
            watch,
            n_completed: 0,
            faults: BTreeMap::new(),
        }
    }

    fn below(&mut self, n: u64) -> u64 {
        self.random.next_u64() % n
    }

    /// The duration of a fault, which is part of the fault and not a way of waiting.
    fn pause(&mut self) {
        let pause_ms = self.below(PAUSE_MS_MAX);
        thread::sleep(Duration::from_millis(pause_ms));
    }

    /// Every fault once, in random order.
    fn deck(&mut self) -> Vec<Fault> {
        let mut deck = FAULTS.to_vec();
        for i in (1..deck.len()).rev() {
            let j = self.below(i as u64 + 1) as usize;
            deck.swap(i, j);
        }
        deck
    }

    /// A random healthy place. One place is never chosen, so that work continues.
    fn place(&mut self) -> &mut Place {
        if self.places.iter().filter(|place| !place.is_troubled).count() < 2 {
            self.places.iter_mut().for_each(Place::heal);
        }
        loop {
            let i = self.below(N_WORKERS as u64) as usize;
            if !self.places[i].is_troubled {
                return &mut self.places[i];
            }
        }
    }

    fn strike(&mut self, fault: Fault) {
        *self.faults.entry(fault).or_default() += 1;
        match fault {
            Fault::WorkerKilled | Fault::WorkerStopped => {
                self.n_workers_started += 1;
                let name = format!("worker-{}", self.n_workers_started);
                let place = self.place();
                if fault == Fault::WorkerKilled {
                    place.worker.process.kill();
                } else {
                    // A worker without any output may not listen for signals yet.
                    place.worker.process.wait_for("sign of life", |_| true);
                    place.worker.process.signal("TERM");
                    assert_eq!(place.worker.process.wait().code(), Some(0));
                }
                place.worker = WorkerProcess::start_with(&place.network.url(), &name, &[]);
            }
            Fault::WorkerFrozen => {
                let place = self.place();
                place.worker.process.signal("STOP");
                place.is_troubled = true;
            }
            Fault::NetworkCut => {
                let place = self.place();
                place.network.cut();
                place.is_troubled = true;
            }
            Fault::NetworkSilent | Fault::NetworkDeaf | Fault::NetworkDead => {
                let place = self.place();
                if fault != Fault::NetworkDeaf {
                    place.network.hold(Direction::ToCoordinator);
                }
                if fault != Fault::NetworkSilent {
                    place.network.hold(Direction::ToWorker);
                }
                place.is_troubled = true;
            }
            Fault::CoordinatorKilled | Fault::CoordinatorStopped => {
                if fault == Fault::CoordinatorKilled {
                    self.coordinator.process.kill();
                } else {
                    self.coordinator.process.signal("TERM");
                    assert_eq!(self.coordinator.process.wait().code(), Some(0));
                }
                self.pause();
                self.coordinator.restart();
            }
            Fault::CoordinatorFrozen => {
                self.coordinator.process.signal("STOP");
                self.pause();
                self.coordinator.process.signal("CONT");
            }
            Fault::DatabaseBlocked => {
                let database = self.coordinator.database();
                database.execute_batch("BEGIN IMMEDIATE").unwrap();
                self.pause();
                database.execute_batch("ROLLBACK").unwrap();
            }
            Fault::RefereeKilled => {
                if !self.kill_referee() {
                    *self.faults.get_mut(&fault).unwrap() -= 1;
                }
            }
            Fault::LiarJoined | Fault::FailureJoined | Fault::HungJoined => {
                self.n_workers_started += 1;
                let name = format!("intruder-{}", self.n_workers_started);
                let worker = intrude(self.coordinator.url(), name, fault, self.below(1 << 20));
                let before = self.intruders.insert(fault, self.runtime.spawn(worker));
                if let Some(before) = before {
                    before.abort();
                }
            }
        }
        self.keep_busy();
        self.pause();
        for i in 0..N_WORKERS {
            if self.places[i].is_troubled && self.below(2) == 0 {
                self.places[i].heal();
            }
        }
    }

    /// Kills the referee's process, if there is one.
    fn kill_referee(&self) -> bool {
        let id = self.coordinator.process.id();
        let children = fs::read_to_string(format!("/proc/{id}/task/{id}/children"));
        // The thread that started it may not be the first.
        let threads = fs::read_dir(format!("/proc/{id}/task")).into_iter().flatten().flatten();
        let of_threads = threads.map(|thread| fs::read_to_string(thread.path().join("children")));
        let ids: Vec<String> = of_threads
            .chain([children])
            .flatten()
            .flat_map(|ids| ids.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
            .collect();
        ids.iter().any(|id| {
            let killed = Command::new("kill").args(["-KILL", id]).status();
            killed.is_ok_and(|status| status.success())
        })
    }

    /// Checks the experiment if it has ended, and submits it again.
    fn keep_busy(&mut self) {
        let n_running: u64 = self
            .coordinator
            .database()
            .query_row("SELECT count(*) FROM experiments WHERE state = 'running'", [], |row| {
                row.get(0)
            })
            .unwrap();
        if n_running == 0 {
            let next = watch(&self.coordinator, &self.experiment);
            let ended = std::mem::replace(&mut self.watch, next);
            assert_eq!(ended.finish().digests(), self.expected);
            self.n_completed += 1;
        }
    }
}

/// Submits the experiment; returns a watch that survives any fault from now on.
fn watch(coordinator: &CoordinatorProcess, experiment: &Experiment) -> Watch {
    let watch = coordinator.watch(coordinator.submit(&experiment.path()));
    watch.wait_for_a_generation();
    watch
}

/// A bad worker: it lies with values of its own, reports that items fail, or answers nothing.
async fn intrude(url: String, name: String, fault: Fault, salt: u64) {
    let hello = Hello { name, slots: 2, ..hello() };
    loop {
        let Ok(mut worker) = HandWorker::connect(&url, hello.clone()).await else {
            tokio::time::sleep(Duration::from_millis(50)).await;
            continue;
        };
        let mut heart = tokio::time::interval(Duration::from_millis(200));
        loop {
            let message = tokio::select! {
                _ = heart.tick() => {
                    worker.say(Message::Heartbeat(Heartbeat {})).await;
                    continue;
                }
                message = worker.receive() => message,
            };
            let Ok(message) = message else { break };
            let work_response::Message::Assignments(batch) = message else { continue };
            for assignment in batch.assignments {
                let outcome = match fault {
                    Fault::LiarJoined => {
                        let value = 0.125 + salt as f64 * 1e-6;
                        let values = vec![value; assignment.trial_count as usize];
                        Outcome::Fitness(TrialFitness { values })
                    }
                    Fault::FailureJoined => {
                        Outcome::Failure(ItemFailure { message: "it overflowed".to_owned() })
                    }
                    _ => continue,
                };
                worker.answer(assignment.assignment_id, outcome).await;
            }
        }
    }
}

fn setting<T: FromStr>(name: &str) -> Option<T> {
    let text = env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is {text}, not a number")))
}

/// Prints a line that bypasses the capture of a test's output.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

#[test]
#[allow(clippy::disallowed_methods, reason = "the test lasts for a given time")]
fn any_mix_of_faults_comes_to_the_undisturbed_digest() {
    let seed =
        setting("SWARM_SOAK_SEED").unwrap_or_else(|| RandomState::new().build_hasher().finish());
    let seconds = setting("SWARM_SOAK_SECONDS").unwrap_or(DEFAULT_SECONDS);
    say(&format!("soak: {seconds} s with SWARM_SOAK_SEED={seed}"));
    let mut soak = Soak::start(seed);
    let started = Instant::now();
    let mut is_over = false;
    while !is_over {
        for fault in soak.deck() {
            soak.strike(fault);
            // Every kind of fault should happen at least once.
            let n_kinds = soak.faults.values().filter(|&&n| n > 0).count();
            is_over = started.elapsed() > Duration::from_secs(seconds) && n_kinds == FAULTS.len();
            if is_over {
                break;
            }
        }
    }
    soak.places.iter_mut().for_each(Place::heal);
    // The workers and the coordinator live until it is finished.
    let Soak { watch, expected, places, coordinator, faults, runtime, .. } = soak;
    assert_eq!(watch.finish().digests(), expected);
    let database = coordinator.database();
    let mut names = database.prepare("SELECT name FROM quarantine").unwrap();
    let names = names.query_map([], |row| row.get::<_, String>(0)).unwrap();
    let names: Vec<String> = names.map(Result::unwrap).collect();
    assert!(names.iter().all(|name| name.starts_with("intruder-")), "wrongly accused: {names:?}");
    drop((places, coordinator));
    runtime.shutdown_background();
    let (n_experiments, n_faults) = (soak.n_completed + 1, faults.values().sum::<usize>());
    say(&format!("soak: {n_experiments} experiments came through {n_faults} faults: {faults:?}"));
}

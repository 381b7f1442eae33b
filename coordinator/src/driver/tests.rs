//! What the loop does with what comes too late, or at the same time.

use std::fs;

use crate::{
    store::{Experiment, Store},
    submission::{Checked, Submission},
};

use super::*;

const ID: ExperimentId = ExperimentId(1);

fn checked() -> Checked {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
    let config_json = fs::read_to_string(path).unwrap();
    Submission { config_json, ..Submission::default() }.check().unwrap()
}

fn runnable() -> Runnable {
    let Checked { new, evolution, .. } = checked();
    Runnable::new(ID, new.config, evolution, new.priority)
}

#[tokio::test]
async fn the_stale_end_of_a_reopened_run_does_not_end_it() {
    let directory = tempfile::tempdir().unwrap();
    let store = SharedStore::new(Store::open(directory.path()).unwrap());
    let (_events, queue) = channel();
    let config = EngineConfig::new(Duration::from_secs(10));
    let mut driver = Driver::new(store, queue, config, CancellationToken::new());

    // The last generation of a run is being stored.
    let Runnable { config, .. } = runnable();
    driver.n_started = 1;
    driver.experiments.insert(ID, Running::new(config, 1));
    // It is stored, a client asks for more generations, and only then does the
    // driver hear of the end of what was asked for before.
    driver.on_event(Event::ExperimentReady(Box::new(runnable())));
    driver.on_advanced(Advanced { run: RunId { id: ID, incarnation: 1 }, step: Step::Ended });

    assert!(driver.experiments[&ID].round.is_some(), "it runs");
    let (outbox, mut inbox) = mpsc::channel(16);
    let (reply, _id) = oneshot::channel();
    let link = WorkerLink { outbox, dropped: CancellationToken::new() };
    let introduction =
        Introduction { name: "w".to_owned(), version: String::new(), n_slots: 1, process: None };
    driver.on_event(Event::WorkerJoined { introduction, link, reply });
    while let Some(command) = driver.engine.poll_command() {
        driver.carry_out(command);
    }
    let mut has_work = false;
    while let Ok(message) = inbox.try_recv() {
        has_work |= matches!(
            message,
            ToWorker::Assignments {
                job: JobId::Experiment(ID),
                trial_set: TrialSet::Generation(0),
                ..
            }
        );
    }
    assert!(has_work, "and workers get its items");

    driver.on_advanced(Advanced { run: RunId { id: ID, incarnation: 2 }, step: Step::Ended });
    assert!(driver.experiments.is_empty(), "its own end ends it");
}

/// A driver with a database, one worker, and one experiment, submitted to both.
struct Rig {
    driver: Driver,
    inbox: mpsc::Receiver<ToWorker>,
    worker: WorkerId,
    _directory: tempfile::TempDir,
}

impl Rig {
    async fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut store = Store::open(directory.path()).unwrap();
        let Checked { new, evolution, .. } = checked();
        store.create(&new, 0).unwrap();
        let (_events, queue) = channel();
        let config = EngineConfig::new(Duration::from_secs(10));
        let shutdown = CancellationToken::new();
        let mut driver = Driver::new(SharedStore::new(store), queue, config, shutdown);
        let (outbox, inbox) = mpsc::channel(1024);
        let (reply, id) = oneshot::channel();
        let link = WorkerLink { outbox, dropped: CancellationToken::new() };
        let introduction = Introduction {
            name: "w".to_owned(),
            version: String::new(),
            n_slots: 1000,
            process: None,
        };
        driver.on_event(Event::WorkerJoined { introduction, link, reply });
        let runnable = Runnable::new(ID, new.config, evolution, new.priority);
        driver.on_event(Event::ExperimentReady(Box::new(runnable)));
        Self { driver, inbox, worker: id.await.unwrap(), _directory: directory }
    }

    /// Carries out what there is to do; the worker answers all it is sent. Returns
    /// of which generation that was.
    fn answer(&mut self) -> Option<u64> {
        let mut answered = None;
        loop {
            while let Some(command) = self.driver.engine.poll_command() {
                self.driver.carry_out(command);
            }
            let Ok(message) = self.inbox.try_recv() else { return answered };
            let ToWorker::Assignments { trial_set, assignments, .. } = message else { continue };
            answered = trial_set.generation();
            let results = assignments.into_iter().map(|it| ItemResult {
                id: it.id,
                outcome: Ok(it.trials.map(|_| it.genotype[0]).collect()),
                compute_time: Duration::from_millis(1),
            });
            let spoke = WorkerMessage::Results(results.collect());
            self.driver.on_event(Event::WorkerSpoke(self.worker, spoke));
        }
    }

    /// Waits for the next step of the experiment.
    async fn advance(&mut self) {
        let advanced = self.driver.advancing.join_next().await.unwrap().unwrap();
        self.driver.on_advanced(advanced);
    }

    async fn stored(&self) -> Experiment {
        self.driver.store.read(|store| store.experiment(ID)).await.unwrap().unwrap()
    }
}

#[tokio::test]
async fn a_generation_is_judged_while_the_one_before_is_stored() {
    let mut rig = Rig::new().await;
    assert_eq!(rig.answer(), Some(0));
    rig.advance().await;
    assert!(rig.driver.experiments[&ID].is_storing);
    assert_eq!(rig.answer(), Some(1), "before generation 0 is known to be stored");
    // In whatever order it hears that 0 is stored and what 1 teaches, 2 is judged
    // only when 0 is stored, and they are stored in order.
    rig.advance().await;
    rig.advance().await;
    assert!(rig.stored().await.latest.is_some(), "0 is stored");
    assert_eq!(rig.answer(), Some(2));
}

#[tokio::test]
async fn what_is_being_stored_when_an_experiment_is_cancelled_is_stored_first() {
    let mut rig = Rig::new().await;
    rig.answer();
    rig.advance().await;
    let (reply, cancelled) = oneshot::channel();
    rig.driver.on_event(Event::Requested { experiment: ID, request: Request::Cancel, reply });
    assert_eq!(rig.answer(), Some(1), "its items are on their way");
    rig.advance().await;
    while rig.driver.ledger.advance().await.is_some() {}
    cancelled.await.expect("the client is told");
    assert!(rig.driver.experiments.is_empty() && rig.driver.advancing.is_empty());
    let stored = rig.stored().await;
    assert_eq!(stored.state, ExperimentState::Cancelled);
    assert_eq!(stored.latest.unwrap().generation, 0);
}

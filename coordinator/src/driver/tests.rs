//! The loop with a real store, and with a worker that answers at once.

use std::fs;

use engine::{Introduction, ItemResult, NamePattern};

use crate::{
    ids::WorkerId,
    referee::RefereeProgram,
    store::{ExperimentRecord, Store},
    submission::{CheckedSubmission, Submission},
};

use super::*;

const ID: ExperimentId = ExperimentId(1);

/// A driver with a database, one worker, and one experiment, which the driver and the database
/// have.
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
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/quickstart.json");
        let config_json = fs::read_to_string(path).unwrap();
        let submission = Submission { config_json, ..Submission::default() };
        let CheckedSubmission { new, .. } = submission.check(&|| true).unwrap();
        store.create(&new, 0).unwrap();
        let (_events, queue) = channel();
        let mut driver = Driver::new(
            SharedStore::new(store),
            queue,
            DriverConfig {
                engine: EngineConfig::new(Duration::from_secs(10)),
                memory_budget: u64::MAX,
                referee: Referee::new(RefereeProgram::this_program(), Duration::ZERO),
                quarantine: Vec::new(),
                commit_duration: crate::metrics::Instruments::default().commit_duration,
            },
            CancellationToken::new(),
        );
        let (outbox, inbox) = mpsc::channel(1024);
        let (reply, id) = oneshot::channel();
        let link = WorkerLink { outbox, dropped: CancellationToken::new() };
        let introduction = Introduction {
            name: "w".into(),
            version: String::new(),
            n_slots: 1000,
            experiments: NamePattern::default(),
            process: None,
        };
        driver.on_event(DriverEvent::WorkerJoined { introduction, link, reply });
        let runnable = Runnable::new(ID, new.config, new.genotype_len as u64, new.priority);
        driver.on_event(DriverEvent::ExperimentReady(Box::new(runnable)));
        driver.carry_out_all();
        let mut rig = Self { driver, inbox, worker: id.await.unwrap(), _directory: directory };
        // The experiment is loaded.
        rig.advance().await;
        rig
    }

    /// Carries out all commands; the worker answers every assignment. Returns the generation of
    /// the assignments.
    fn answer(&mut self) -> Option<u64> {
        let mut answered = None;
        loop {
            self.driver.carry_out_all();
            let Ok(message) = self.inbox.try_recv() else { return answered };
            let ToWorker::Assignments(Assignments { trial_set, items, .. }) = message else {
                continue;
            };
            answered = trial_set.generation();
            let results = items.into_iter().map(|assignment| ItemResult {
                id: assignment.id,
                output: sim_core::Output::Fitness,
                outcome: Ok(assignment.trials.map(|_| assignment.genotype[0]).collect()),
                compute_time: Duration::from_millis(1),
            });
            let spoke = WorkerMessage::Results(results.collect());
            self.driver.on_event(DriverEvent::WorkerSpoke(self.worker, spoke));
        }
    }

    /// Waits for a task to end.
    async fn advance(&mut self) {
        let done = self.driver.tasks.join_next().await.unwrap();
        self.driver.on_task_done(done);
        self.driver.carry_out_all();
    }

    async fn stored(&self) -> ExperimentRecord {
        self.driver.disk.store.read(|store| store.experiment(ID)).await.unwrap().unwrap().record
    }
}

#[tokio::test]
async fn generations_are_evaluated_and_stored() {
    let mut rig = Rig::new().await;
    assert_eq!(rig.answer(), Some(0));
    rig.advance().await;
    assert_eq!(rig.answer(), Some(1), "before generation 0 is known to be stored");
    // Generation 2 is evaluated only after 0 is stored, and generations are stored in order,
    // whether the commit of 0 or the conclusion of 1 ends first.
    rig.advance().await;
    rig.advance().await;
    assert!(rig.stored().await.latest.is_some(), "0 is stored");
    assert_eq!(rig.answer(), Some(2));
}

#[tokio::test]
async fn a_client_that_cancels_is_told_when_the_end_is_stored() {
    let mut rig = Rig::new().await;
    rig.answer();
    rig.advance().await;
    let (reply, cancelled) = oneshot::channel();
    rig.driver.on_event(DriverEvent::Requested { experiment: ID, request: Request::Cancel, reply });
    rig.driver.carry_out_all();
    while !rig.driver.tasks.is_empty() {
        rig.advance().await;
    }
    cancelled.await.expect("the client is told");
    let stored = rig.stored().await;
    assert_eq!(stored.state, ExperimentState::Cancelled);
    assert_eq!(stored.latest.unwrap().generation, 0);
    assert_eq!(rig.driver.stats().runs.len(), 0);
}

#[tokio::test]
async fn an_evaluation_whose_client_has_gone_is_dropped() {
    let mut rig = Rig::new().await;
    let evaluation = Box::new(Evaluation {
        name: "quickstart".into(),
        spec: "{}".into(),
        batch: engine::Batch::measures(vec![0.5], 1, 1),
        priority: crate::priority::Priority::default(),
    });
    let (reply, result) = oneshot::channel();
    rig.driver.on_event(DriverEvent::EvaluationRequested(evaluation, reply));
    drop(result);
    rig.driver.drop_abandoned_evaluations();
    rig.driver.carry_out_all();
    assert!(rig.driver.evaluations.is_empty());
    let mut is_told = false;
    while let Ok(message) = rig.inbox.try_recv() {
        is_told |= matches!(message, ToWorker::End(JobId::Evaluation(_)));
    }
    assert!(is_told, "the worker drops it");
}

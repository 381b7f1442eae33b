//! The loop that connects the engine, evolution and the store with the network.
//!
//! It decides nothing: everything that happens becomes an [`Event`], the engine
//! answers with commands, and the loop carries them out. What may take long
//! (evolution's arithmetic, the disk) runs beside it.

mod advance;
mod evaluations;
mod figures;
mod ledger;
mod requests;
mod round;

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use experiment_file::ExperimentConfig;
use sim_core::{Output, TrialSet};
use tokio::{
    sync::{mpsc, oneshot},
    task::JoinSet,
    time::MissedTickBehavior,
};
use tokio_util::sync::CancellationToken;
use tracing::{debug, error, info, warn};

use crate::{
    clock,
    engine::{
        Assignment, Batch, Command, Engine, EngineConfig, EvaluatedBatch, Introduction, ItemResult,
        JobActivity, WorkerStatus,
    },
    failpoint,
    ids::{AssignmentId, EvaluationId, ExperimentId, JobId, WorkerId},
    metrics::Instruments,
    priority::Priority,
    shared_store::SharedStore,
    store::{ExperimentState, Generation},
    submission::Runnable,
};

use advance::{Advanced, RunId, Step};
pub use evaluations::Evaluation;
use evaluations::Reply;
pub use figures::{ExperimentFigures, Figures};
use ledger::{Change, Entry, Ledger};
pub use round::Round;
use round::{Complete, Next};

/// Events that wait for the loop; whoever sends more waits.
const EVENT_QUEUE_LEN: usize = 1024;
/// How soon late work is noticed.
const TICK_INTERVAL_MAX: Duration = Duration::from_millis(100);
/// Genotypes of about this many bytes travel in one message.
const BATCH_LEN: usize = 1 << 20;

/// Everything that can happen.
#[derive(Debug)]
pub enum Event {
    /// A worker has introduced itself and its versions agree.
    WorkerJoined {
        /// Who it is.
        introduction: Introduction,
        /// The way to it.
        link: WorkerLink,
        /// Gets its id.
        reply: oneshot::Sender<WorkerId>,
    },
    /// A worker has sent something.
    WorkerSpoke(WorkerId, WorkerMessage),
    /// A worker's stream has ended.
    WorkerLeft {
        /// Whose.
        worker: WorkerId,
        /// How, for the log.
        reason: String,
    },
    /// A stored experiment is to run.
    ExperimentReady(Box<Runnable>),
    /// A client wants something of an unfinished experiment.
    Requested {
        /// Of which.
        experiment: ExperimentId,
        /// What.
        request: Request,
        /// Answered when it is stored.
        reply: oneshot::Sender<()>,
    },
    /// A client wants to see the workers.
    WorkersRequested(oneshot::Sender<Vec<WorkerStatus>>),
    /// A client wants a genotype evaluated.
    EvaluationRequested(Box<Evaluation>),
    /// A client wonders what becomes of an experiment.
    ActivityRequested(ExperimentId, oneshot::Sender<JobActivity>),
    /// Somebody scrapes metrics.
    FiguresRequested(oneshot::Sender<Figures>),
}

/// What a client may want of an unfinished experiment.
#[derive(Debug, Clone)]
pub enum Request {
    /// That it ends.
    Cancel,
    /// That it waits to be resumed; why.
    Pause(String),
    /// That it goes on.
    Resume,
    /// Another share of the fleet.
    SetPriority(Priority),
}

/// What a worker says after its introduction.
#[derive(Debug)]
pub enum WorkerMessage {
    /// It is alive.
    Heartbeat,
    /// It has computed items.
    Results(Vec<ItemResult>),
    /// It wants no more items.
    Draining,
}

/// The way to a connected worker.
#[derive(Debug)]
pub struct WorkerLink {
    /// Bounded; a worker that lets it fill up does not read and is dropped.
    pub outbox: mpsc::Sender<ToWorker>,
    /// Cancelled when the coordinator has dropped the worker.
    pub dropped: CancellationToken,
}

/// What a worker is told.
#[derive(Debug)]
pub enum ToWorker {
    /// It is welcome under this id.
    Welcome(WorkerId),
    /// A job's specification.
    Spec(JobId, Arc<str>),
    /// Items of a job's batch.
    Assignments {
        /// The job whose batch it is.
        job: JobId,
        /// Which worlds and noise the trials meet.
        trial_set: TrialSet,
        /// What is returned for a trial.
        output: Output,
        /// At least one.
        assignments: Vec<Assignment>,
    },
    /// Assignments whose results are not wanted any more.
    Drop(Vec<AssignmentId>),
    /// A job is over, or paused.
    End(JobId),
    /// It is dropped; why.
    Dropped(String),
}

/// Sends events to the loop.
pub type EventSender = mpsc::Sender<Event>;

/// A channel to a loop that is yet to run.
pub fn channel() -> (EventSender, mpsc::Receiver<Event>) {
    mpsc::channel(EVENT_QUEUE_LEN)
}

/// The loop's state.
pub struct Driver {
    engine: Engine,
    store: SharedStore,
    events: mpsc::Receiver<Event>,
    shutdown: CancellationToken,
    instruments: Instruments,
    tick_interval: Duration,
    workers: BTreeMap<WorkerId, ConnectedWorker>,
    experiments: BTreeMap<ExperimentId, Running>,
    n_started: u64,
    /// Who waits for which evaluation.
    evaluations: BTreeMap<EvaluationId, Reply>,
    n_evaluations: u64,
    /// Judged rounds whose conclusions are being drawn and stored.
    advancing: JoinSet<Advanced>,
    /// Everything else that is being stored.
    ledger: Ledger,
}

struct ConnectedWorker {
    name: String,
    link: WorkerLink,
    is_draining: bool,
}

/// An experiment that has not ended. A generation is stored while the next one is
/// judged; one that is complete before waits, so that they are stored in order.
struct Running {
    config: Arc<ExperimentConfig>,
    /// Tells this run of the experiment from one before more generations were
    /// asked for.
    incarnation: u64,
    /// What is being judged; none while conclusions are drawn, or wait.
    round: Option<Round>,
    /// The latest generation that is on disk.
    latest: Option<Generation>,
    /// What is to be stored next.
    complete: Option<Box<Complete>>,
    is_storing: bool,
    /// How it ends, as soon as what is being stored is stored.
    end: Option<(ExperimentState, String)>,
    /// Who waits for it to end.
    cancellations: Vec<oneshot::Sender<()>>,
}

impl Running {
    fn new(config: ExperimentConfig, incarnation: u64) -> Self {
        Self {
            config: Arc::new(config),
            incarnation,
            round: None,
            latest: None,
            complete: None,
            is_storing: false,
            end: None,
            cancellations: Vec::new(),
        }
    }
}

impl Driver {
    /// A loop without workers or experiments.
    pub fn new(
        store: SharedStore,
        events: mpsc::Receiver<Event>,
        config: EngineConfig,
        shutdown: CancellationToken,
    ) -> Self {
        Self {
            engine: Engine::new(clock::now(), config),
            ledger: Ledger::new(store.clone(), shutdown.clone()),
            store,
            events,
            shutdown,
            instruments: Instruments::default(),
            tick_interval: TICK_INTERVAL_MAX.min(config.lease / 8),
            workers: BTreeMap::new(),
            experiments: BTreeMap::new(),
            n_started: 0,
            evaluations: BTreeMap::new(),
            n_evaluations: 0,
            advancing: JoinSet::new(),
        }
    }

    /// The same loop, which measures what it does with these.
    #[must_use]
    pub fn measured_by(self, instruments: Instruments) -> Self {
        Self { instruments, ..self }
    }

    /// Runs until shutdown, and then finishes what is being stored.
    pub async fn run(mut self) {
        let mut ticks = tokio::time::interval(self.tick_interval);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                () = self.shutdown.cancelled() => break,
                Some(event) = self.events.recv() => self.on_event(event),
                Some(advanced) = self.advancing.join_next() => match advanced {
                    Ok(advanced) => self.on_advanced(advanced),
                    // Its experiment would wait for ever. At the next start it goes on
                    // from its last commit.
                    Err(error) => panic!("storing a generation: {error}"),
                },
                Some(()) = self.ledger.advance() => {}
                _ = ticks.tick() => {
                    self.drop_abandoned_evaluations();
                    self.engine.on_tick(clock::now());
                }
            }
            while let Some(command) = self.engine.poll_command() {
                self.carry_out(command);
            }
        }
        // Dropping the links ends the workers' streams.
        self.workers.clear();
        while self.advancing.join_next().await.is_some() {}
        while self.ledger.advance().await.is_some() {}
    }

    fn on_event(&mut self, event: Event) {
        failpoint::reached("event");
        let now = clock::now();
        match event {
            Event::WorkerJoined { introduction, link, reply } => {
                let Introduction { name, version, n_slots, .. } = introduction.clone();
                let id = self.engine.on_worker_joined(now, introduction);
                // The worker is welcomed before it is sent work: commands are
                // carried out after this.
                self.workers
                    .insert(id, ConnectedWorker { name: name.clone(), link, is_draining: false });
                self.send(id, ToWorker::Welcome(id));
                let fleet = self.engine.fleet_size();
                info!(
                    worker = %id, name, version, slots = n_slots,
                    workers = fleet.n_workers, total_slots = fleet.n_slots,
                    "worker joined"
                );
                // If the stream is gone already, its end will be reported.
                let _ = reply.send(id);
            }
            Event::WorkerSpoke(id, message) => match message {
                WorkerMessage::Heartbeat => self.engine.on_heartbeat(now, id),
                WorkerMessage::Results(results) => self.engine.on_results(now, id, results),
                WorkerMessage::Draining => {
                    if let Some(worker) = self.workers.get_mut(&id) {
                        worker.is_draining = true;
                        info!(worker = %id, name = worker.name, "worker is draining");
                    }
                    self.engine.on_draining(now, id);
                }
            },
            Event::WorkerLeft { worker, reason } => self.on_worker_left(worker, &reason),
            Event::ExperimentReady(runnable) => self.start(*runnable),
            Event::EvaluationRequested(evaluation) => self.evaluate(*evaluation),
            Event::Requested { experiment, request, reply } => {
                self.on_request(experiment, request, reply);
            }
            // If the client is gone it need not be told.
            Event::WorkersRequested(reply) => drop(reply.send(self.engine.worker_status(now))),
            Event::ActivityRequested(id, reply) => {
                drop(reply.send(self.engine.activity(now, id.into())));
            }
            Event::FiguresRequested(reply) => drop(reply.send(self.figures())),
        }
    }

    fn start(&mut self, runnable: Runnable) {
        let id = runnable.id;
        let generations = runnable.config.algorithm.generations;
        info!(
            experiment = %id, name = runnable.config.name, seed = runnable.config.seed,
            generation = runnable.round.trial_set().generation(), generations,
            "experiment starts"
        );
        self.engine.on_job_started(id.into(), runnable.spec, runnable.priority);
        if runnable.is_paused {
            info!(experiment = %id, "experiment is paused");
            self.engine.on_job_paused(clock::now(), id.into());
        }
        self.n_started += 1;
        let running =
            Running { latest: runnable.latest, ..Running::new(runnable.config, self.n_started) };
        self.experiments.insert(id, running);
        self.judge(id, runnable.round);
    }

    /// Has the fleet judge a round.
    fn judge(&mut self, id: ExperimentId, round: Round) {
        let Some(running) = self.experiments.get_mut(&id) else { return };
        let n_trials = round.n_trials(&running.config);
        let batch = Batch::fitness(round.trial_set(), round.genotypes(), n_trials);
        running.round = Some(round);
        self.engine.on_batch_requested(clock::now(), id.into(), batch);
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::SendSpec { worker, job, spec } => self.send(worker, ToWorker::Spec(job, spec)),
            Command::SendAssignments { worker, job, trial_set, output, assignments } => {
                debug!(
                    %worker, %job, generation = trial_set.generation(), trials = trial_set.kind(),
                    items = assignments.len(), "items assigned"
                );
                let genotype_len = size_of_val(assignments[0].genotype.as_slice()).max(1);
                for assignments in assignments.chunks((BATCH_LEN / genotype_len).max(1)) {
                    let assignments = assignments.to_vec();
                    let message = ToWorker::Assignments { job, trial_set, output, assignments };
                    self.send(worker, message);
                }
            }
            Command::SendDrop { worker, assignments } => {
                self.send(worker, ToWorker::Drop(assignments));
            }
            Command::SendEnd { worker, job } => self.send(worker, ToWorker::End(job)),
            Command::Disconnect { worker, reason, n_items_requeued } => {
                self.send(worker, ToWorker::Dropped(reason.clone()));
                self.forget_worker(worker, &reason, n_items_requeued);
            }
            Command::FinishBatch { job: JobId::Evaluation(id), mut evaluated } => {
                self.finish_evaluation(id, Ok(evaluated.values.swap_remove(0)));
            }
            Command::FailJob { job: JobId::Evaluation(id), reason }
            | Command::PauseJob { job: JobId::Evaluation(id), reason } => {
                error!(evaluation = %id, reason, "evaluation failed");
                self.finish_evaluation(id, Err(reason));
            }
            Command::FinishBatch { job: JobId::Experiment(experiment), evaluated } => {
                let Some(running) = self.experiments.get_mut(&experiment) else { return };
                let Some(round) = running.round.take() else { return };
                let EvaluatedBatch { trial_set, n_audited, n_unaudited, .. } = evaluated;
                let (generation, trials) = (trial_set.generation(), trial_set.kind());
                debug!(%experiment, generation, trials, n_audited, "batch evaluated");
                if n_unaudited > 0 {
                    warn!(
                        %experiment, generation, trials, n_audited, n_unaudited,
                        "there was no second worker to audit results"
                    );
                }
                let run = RunId { id: experiment, incarnation: running.incarnation };
                let config = Arc::clone(&running.config);
                self.advancing.spawn(advance::conclude(run, config, round, evaluated));
            }
            Command::FailJob { job: JobId::Experiment(experiment), reason } => {
                self.end(experiment, ExperimentState::Failed, reason);
            }
            Command::PauseJob { job: JobId::Experiment(experiment), reason } => {
                error!(%experiment, reason, "experiment paused");
                let paused = Change::State(ExperimentState::Paused, reason.clone());
                for change in [Change::Notice(reason), paused] {
                    self.ledger.push(Entry { experiment, change, replies: Vec::new() });
                }
            }
        }
    }

    fn on_advanced(&mut self, Advanced { run, step }: Advanced) {
        let id = run.id;
        let Some(running) = self.experiments.get_mut(&id) else { return };
        if running.incarnation != run.incarnation {
            return;
        }
        match step {
            Step::Concluded(Next::Judge(round)) => self.judge(id, *round),
            Step::Concluded(Next::Commit(complete)) => {
                running.complete = Some(complete);
                self.store_next(id);
            }
            Step::Stored(generation) => {
                running.is_storing = false;
                running.latest = Some(generation);
                match running.end.take() {
                    Some((state, reason)) => self.end(id, state, reason),
                    None => self.store_next(id),
                }
            }
            Step::Ended => {
                running.is_storing = false;
                if let Some((state, reason)) = running.end.take() {
                    self.end(id, state, reason);
                } else {
                    self.experiments.remove(&id);
                    self.engine.on_job_ended(clock::now(), id.into());
                }
            }
            Step::Failed(reason) => self.end(id, ExperimentState::Failed, reason),
            Step::NotStored(reason) => {
                running.is_storing = false;
                let failed = (ExperimentState::Failed, reason);
                let (state, reason) = running.end.take().unwrap_or(failed);
                self.end(id, state, reason);
            }
        }
    }

    /// Stores a complete generation, unless the one before is still being stored,
    /// and has the next one judged meanwhile. If the coordinator dies before the
    /// first is stored, both are judged again, to the same bits.
    fn store_next(&mut self, id: ExperimentId) {
        let Some(running) = self.experiments.get_mut(&id) else { return };
        if running.is_storing {
            return;
        }
        let Some(mut complete) = running.complete.take() else { return };
        running.is_storing = true;
        let next = complete.next.take();
        let run = RunId { id, incarnation: running.incarnation };
        let (config, store) = (Arc::clone(&running.config), self.store.clone());
        let shutdown = self.shutdown.clone();
        let duration = self.instruments.commit_duration.clone();
        self.advancing.spawn(advance::commit(run, config, store, shutdown, duration, *complete));
        if let Some(round) = next {
            self.judge(id, round);
        }
    }

    fn send(&mut self, id: WorkerId, message: ToWorker) {
        let Some(worker) = self.workers.get(&id) else { return };
        if worker.link.outbox.try_send(message).is_err() {
            self.on_worker_left(id, "it does not read what it is sent");
        }
    }

    fn on_worker_left(&mut self, id: WorkerId, reason: &str) {
        let n_items_requeued = self.engine.on_worker_left(clock::now(), id);
        self.forget_worker(id, reason, n_items_requeued);
    }

    fn forget_worker(&mut self, id: WorkerId, reason: &str, items_requeued: usize) {
        let Some(ConnectedWorker { name, link, is_draining }) = self.workers.remove(&id) else {
            return;
        };
        link.dropped.cancel();
        let workers = self.engine.fleet_size().n_workers;
        if is_draining {
            info!(worker = %id, name, items_requeued, workers, "worker left");
        } else {
            warn!(worker = %id, name, reason, items_requeued, workers, "worker lost");
        }
    }
}

#[cfg(test)]
mod tests;

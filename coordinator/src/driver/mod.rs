//! The loop that connects the engine and the life of runs with the network and the
//! store.
//!
//! It decides nothing. Every input becomes a [`DriverEvent`] or the end of a task. Two state
//! machines answer with commands: the [`Engine`] assigns items to workers, [`Runs`] decides the
//! next step of each experiment. The loop carries the commands out. Slow work runs beside the
//! loop, in [`tasks`].

mod events;
mod questions;
mod stats;
mod tasks;
mod workers;

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use swarm_telemetry::Histogram;
use tokio::{
    sync::{mpsc, oneshot, watch},
    task::{self, JoinSet},
    time::MissedTickBehavior,
};
use tokio_util::sync::CancellationToken;
use tracing::{debug, error, info, warn};

use engine::Verdict;
use engine::{Assignments, Engine, EngineConfig, EvaluatedBatch, ToWorker};

use crate::{
    clock, failpoint,
    ids::{EvaluationId, ExperimentId, JobId, QuestionId},
    referee::Referee,
    runs::{self, Evaluation, Request, RequestId, Runnable, Runs},
    shared_store::SharedStore,
    store::{ExperimentState, QuarantinedWorker},
};

pub use events::{
    DriverEvent, EvaluationReply, EventSender, ReadmissionReply, WorkerLink, WorkerMessage, channel,
};
use questions::Questions;
pub use stats::StatsSnapshot;
use tasks::{Disk, Done};
use workers::ConnectedWorkers;

/// Longest time until the loop notices late work.
const TICK_INTERVAL_MAX: Duration = Duration::from_millis(100);
/// Bytes of genes in one message of items, counted also for items whose genes the worker draws.
const ITEMS_LEN_MAX: usize = 1 << 20;

/// The loop's state.
pub struct Driver {
    engine: Engine,
    runs: Runs,
    disk: Disk,
    events: mpsc::Receiver<DriverEvent>,
    shutdown: CancellationToken,
    tick_interval: Duration,
    workers: ConnectedWorkers,
    /// The clients that wait for a change to be stored.
    requests: BTreeMap<RequestId, oneshot::Sender<()>>,
    n_requests: u64,
    /// The clients that wait for an evaluation.
    evaluations: BTreeMap<EvaluationId, EvaluationReply>,
    tasks: JoinSet<Done>,
    questions: Questions,
    /// Changes of the quarantine that are not stored yet, in order; the first is being written.
    quarantine_changes: VecDeque<QuarantineChange>,
    /// Counts changes of the fleet.
    fleet_news: watch::Sender<u64>,
}

/// A worker enters or leaves quarantine.
enum QuarantineChange {
    Add(QuarantinedWorker),
    /// `reply` tells the client once the change is stored.
    Remove {
        name: String,
        reply: ReadmissionReply,
    },
}

/// The configuration of the loop.
#[derive(Debug)]
pub struct DriverConfig {
    /// The configuration of the engine.
    pub engine: EngineConfig,
    /// Bytes of memory for all experiments together.
    pub memory_budget: u64,
    /// Computes items for which a worker's result is in doubt.
    pub referee: Referee,
    /// Workers that have been proved faulty.
    pub quarantine: Vec<QuarantinedWorker>,
    /// Durations of commits, s.
    pub commit_duration: Histogram,
}

impl Driver {
    /// A loop without workers or experiments.
    pub fn new(
        store: SharedStore,
        events: mpsc::Receiver<DriverEvent>,
        config: DriverConfig,
        shutdown: CancellationToken,
    ) -> Self {
        let DriverConfig { engine: config, memory_budget, referee, quarantine, commit_duration } =
            config;
        let mut engine = Engine::new(clock::engine_now(), config);
        for QuarantinedWorker { name, reason } in quarantine {
            engine.on_quarantine_restored(&name, &reason);
        }
        Self {
            engine,
            runs: Runs::new(memory_budget),
            disk: Disk { store, shutdown: shutdown.clone(), commit_duration },
            events,
            shutdown,
            tick_interval: TICK_INTERVAL_MAX.min(config.lease / 8),
            workers: BTreeMap::new(),
            requests: BTreeMap::new(),
            n_requests: 0,
            evaluations: BTreeMap::new(),
            tasks: JoinSet::new(),
            questions: Questions::new(referee),
            quarantine_changes: VecDeque::new(),
            fleet_news: watch::Sender::new(0),
        }
    }

    /// Runs until shutdown, and then finishes writes in progress.
    pub async fn run(mut self) {
        let mut ticks = tokio::time::interval(self.tick_interval);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                () = self.shutdown.cancelled() => break,
                Some(event) = self.events.recv() => self.on_event(event),
                Some(done) = self.tasks.join_next() => self.on_task_done(done),
                (question, verdict) = self.questions.answer() => {
                    log_verdict(question, &verdict);
                    self.engine.on_verdict(clock::engine_now(), question, verdict);
                }
                _ = ticks.tick() => {
                    self.drop_abandoned_evaluations();
                    self.engine.on_tick(clock::engine_now());
                }
            }
            self.carry_out_all();
        }
        // Dropping the links ends the workers' streams.
        self.workers.clear();
        self.questions.shutdown().await;
        self.runs.on_shutdown();
        while let Some(done) = self.tasks.join_next().await {
            self.on_task_done(done);
            self.carry_out_all();
        }
    }

    fn on_event(&mut self, event: DriverEvent) {
        failpoint::reached("event");
        let now = clock::engine_now();
        match event {
            DriverEvent::WorkerJoined { introduction, link, reply } => {
                self.on_worker_joined(introduction, link, reply);
            }
            DriverEvent::WorkerSpoke(id, message) => match message {
                WorkerMessage::Heartbeat => self.engine.on_heartbeat(now, id),
                WorkerMessage::Results(results) => self.engine.on_results(now, id, results),
                WorkerMessage::Draining => self.on_worker_draining(id),
            },
            DriverEvent::WorkerLeft { worker, reason } => self.on_worker_left(worker, &reason),
            DriverEvent::ExperimentReady(runnable) => self.start(*runnable),
            DriverEvent::EvaluationRequested(evaluation, reply) => {
                self.evaluate(*evaluation, reply);
            }
            DriverEvent::Requested { experiment, request, reply } => {
                log_request(experiment, &request);
                self.n_requests += 1;
                let request_id = RequestId(self.n_requests);
                self.requests.insert(request_id, reply);
                self.runs.on_request(experiment, request, request_id);
            }
            // If the client is gone it need not be told.
            DriverEvent::WorkersRequested(reply) => {
                drop(reply.send(self.engine.worker_status(now)));
            }
            DriverEvent::EvaluationsRequested(reply) => {
                drop(reply.send(self.engine.evaluations(now)));
            }
            DriverEvent::TimelineRequested(reply) => {
                drop(reply.send(self.engine.timeline(now)));
            }
            DriverEvent::WorkerReadmitted { name, reply } => {
                if self.engine.on_readmitted(now, &name) {
                    info!(name, "worker is readmitted");
                    self.change_quarantine(QuarantineChange::Remove { name, reply });
                } else {
                    let names = self.engine.quarantine().map(|(name, _)| name.to_owned());
                    drop(reply.send(Err(names.collect())));
                }
            }
            DriverEvent::ActivityRequested(id, reply) => {
                let activity = self.engine.activity(now, id.into());
                drop(reply.send((activity, self.runs.shortage(id))));
            }
            DriverEvent::FleetWatched(reply) => drop(reply.send(self.fleet_news.subscribe())),
            DriverEvent::StatsRequested(reply) => drop(reply.send(self.stats())),
        }
    }

    fn start(&mut self, runnable: Runnable) {
        if runnable.is_paused {
            info!(experiment = %runnable.id, "experiment is paused");
        }
        self.runs.on_submitted(runnable);
    }

    fn evaluate(&mut self, evaluation: Evaluation, reply: EvaluationReply) {
        let trials = evaluation.batch.n_trials;
        let id = self.runs.on_evaluation_requested(evaluation);
        debug!(evaluation = %id, trials, "evaluation starts");
        self.evaluations.insert(id, reply);
    }

    /// Ends evaluations whose clients have gone.
    fn drop_abandoned_evaluations(&mut self) {
        for (id, _) in self.evaluations.extract_if(.., |_, reply| reply.is_closed()) {
            info!(evaluation = %id, "evaluation dropped: its client has gone");
            self.runs.on_evaluation_abandoned(id);
        }
    }

    fn change_quarantine(&mut self, change: QuarantineChange) {
        self.fleet_news.send_modify(|count| *count += 1);
        self.quarantine_changes.push_back(change);
        if self.quarantine_changes.len() == 1 {
            self.write_quarantine();
        }
    }

    /// Stores the next change of the quarantine. Changes are stored in order, one at a time.
    fn write_quarantine(&mut self) {
        if let Some(change) = self.quarantine_changes.front() {
            let write = match change {
                QuarantineChange::Add(worker) => tasks::QuarantineWrite::Add(worker.clone()),
                QuarantineChange::Remove { name, .. } => {
                    tasks::QuarantineWrite::Remove(name.clone())
                }
            };
            self.tasks.spawn(tasks::write_quarantine(write, self.disk.clone()));
        }
    }

    fn on_task_done(&mut self, done: Result<Done, task::JoinError>) {
        match done {
            Ok(Done::Loaded(run, loaded)) => self.runs.on_loaded(run, loaded),
            Ok(Done::Concluded(run, conclusion)) => self.runs.on_concluded(run, conclusion),
            Ok(Done::Committed(run, outcome)) => self.runs.on_committed(run, outcome),
            Ok(Done::QuarantineWritten) => {
                if let Some(QuarantineChange::Remove { reply, .. }) =
                    self.quarantine_changes.pop_front()
                {
                    // A client that has stopped waiting need not be told.
                    drop(reply.send(Ok(())));
                }
                self.write_quarantine();
            }
            Ok(Done::QuarantineNotWritten) => self.quarantine_changes.clear(),
            Ok(Done::ChangeWritten(id, is_stored)) => self.runs.on_change_written(id, is_stored),
            // Otherwise a run or a client would wait for ever. After a restart, every experiment
            // continues from its last commit.
            Err(error) => panic!("storing a generation or a change: {error}"),
        }
    }

    /// Carries out the commands of both state machines until none are left.
    fn carry_out_all(&mut self) {
        loop {
            if let Some(command) = self.runs.poll_command() {
                self.carry_out(command);
            } else if let Some(command) = self.engine.poll_command() {
                self.carry_out_for_engine(command);
            } else {
                return;
            }
        }
    }

    fn carry_out(&mut self, command: runs::Command) {
        use runs::Command;
        let now = clock::engine_now();
        match command {
            Command::StartJob { job, name, spec, priority, is_paused } => {
                self.engine.on_job_started(now, job, name, spec, priority);
                if is_paused {
                    self.engine.on_job_paused(now, job);
                }
            }
            Command::Load { run, config, generation } => {
                info!(
                    experiment = %run.experiment, name = config.name, seed = config.seed,
                    generation, generations = config.algorithm.generations,
                    "experiment starts"
                );
                self.tasks.spawn(tasks::load(run, self.disk.clone()));
            }
            Command::PublishWait { experiment, shortage } => {
                warn!(%experiment, reason = %shortage, "experiment waits for memory");
            }
            Command::Evaluate { job, batch } => self.engine.on_batch_requested(now, job, batch),
            Command::PauseJob { job } => self.engine.on_job_paused(now, job),
            Command::ResumeJob { job } => self.engine.on_job_resumed(now, job),
            Command::SetPriority { job, priority } => self.engine.on_priority_set(job, priority),
            Command::EndJob { job } => self.engine.on_job_ended(now, job),
            Command::Conclude { run, config, round, evaluated } => {
                self.tasks.spawn(tasks::conclude(run, config, round, evaluated));
            }
            Command::Commit { run, config, ready, link } => {
                if let Some(link) = link {
                    task::spawn_blocking(move || link.hash_genes());
                }
                self.tasks.spawn(tasks::commit(run, config, *ready, self.disk.clone()));
            }
            Command::WriteChange { experiment, change } => {
                self.tasks.spawn(tasks::write_change(experiment, change, self.disk.clone()));
            }
            Command::Answer { request, is_stored } => {
                let reply = self.requests.remove(&request).filter(|_| is_stored);
                // A client that has stopped waiting need not be told.
                reply.map(|reply| reply.send(()));
            }
            Command::PublishEnd { experiment, state, reason } => match state {
                ExperimentState::Failed => error!(%experiment, reason, "experiment failed"),
                _ => info!(%experiment, reason, "experiment {}", state.name()),
            },
            Command::AnswerEvaluation { evaluation, result } => {
                let reply = self.evaluations.remove(&evaluation);
                // A client that has gone meanwhile need not be told.
                reply.map(|reply| reply.send(result));
            }
        }
    }

    fn carry_out_for_engine(&mut self, command: engine::Command) {
        use engine::Command;
        match command {
            Command::Send(worker, ToWorker::Assignments(assignments)) => {
                let Assignments { job, trial_set, output, items } = assignments;
                debug!(
                    %worker, %job, generation = trial_set.generation(), trials = trial_set.kind(),
                    items = items.len(), "items assigned"
                );
                let genotype_bytes = size_of_val(items[0].genotype.as_slice()).max(1);
                for items in items.chunks((ITEMS_LEN_MAX / genotype_bytes).max(1)) {
                    let message = Assignments { job, trial_set, output, items: items.to_vec() };
                    self.send(worker, ToWorker::Assignments(message));
                }
            }
            Command::Send(worker, message) => self.send(worker, message),
            Command::Disconnect { worker, reason, n_items_requeued } => {
                self.send(worker, ToWorker::Dropped(reason.clone()));
                self.forget_worker(worker, &reason, n_items_requeued);
            }
            Command::FinishBatch { job: JobId::Evaluation(id), evaluated } => {
                self.runs.on_evaluation_finished(id, Ok(evaluated.values));
            }
            Command::AskReferee { question, request } => self.questions.ask(question, request),
            Command::WithdrawQuestion { question } => self.questions.withdraw(question),
            Command::Quarantine { name, reason } => {
                error!(
                    name,
                    reason, "worker is faulty: it is given nothing until it is readmitted"
                );
                let worker = QuarantinedWorker { name, reason };
                self.change_quarantine(QuarantineChange::Add(worker));
            }
            Command::FailJob { job: JobId::Evaluation(id), reason } => {
                error!(evaluation = %id, reason, "evaluation failed");
                self.runs.on_evaluation_finished(id, Err(reason));
            }
            Command::FinishBatch { job: JobId::Experiment(experiment), evaluated } => {
                let EvaluatedBatch { trial_set, n_audited, n_unaudited, .. } = evaluated;
                let (generation, trials) = (trial_set.generation(), trial_set.kind());
                debug!(%experiment, generation, trials, n_audited, "batch evaluated");
                if n_unaudited > 0 {
                    warn!(
                        %experiment, generation, trials, n_audited, n_unaudited,
                        "there was no second worker to audit results"
                    );
                }
                self.runs.on_batch_evaluated(experiment, evaluated);
            }
            Command::FailJob { job: JobId::Experiment(experiment), reason } => {
                self.runs.on_job_failed(experiment, reason);
            }
        }
    }
}

fn log_verdict(question: QuestionId, verdict: &Verdict) {
    match verdict {
        Verdict::Values(values) => debug!(%question, values = values.len(), "referee: values"),
        Verdict::Failed(failure) => debug!(%question, failure, "referee: failure"),
        Verdict::Died(how) => warn!(%question, how, "an item has taken the referee down"),
        Verdict::Unavailable(reason) => warn!(%question, reason, "the referee cannot answer"),
    }
}

fn log_request(experiment: ExperimentId, request: &Request) {
    match request {
        // The log has the job's end already.
        Request::Cancel | Request::Settle => {}
        Request::Pause(reason) => info!(%experiment, reason, "experiment paused"),
        Request::Resume => info!(%experiment, "experiment resumed"),
        Request::SetPriority(priority) => {
            info!(%experiment, priority = priority.weight(), "experiment reprioritised");
        }
    }
}

#[cfg(test)]
mod tests;

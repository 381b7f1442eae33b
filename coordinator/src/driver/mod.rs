//! The loop that connects the engine, evolution and the store with the network.
//!
//! It decides nothing: everything that happens becomes an [`Event`], the engine
//! answers with commands, and the loop carries them out. What may take long
//! (evolution's arithmetic, the disk) runs beside it.

mod advance;
mod round;

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use sim_core::config::ExperimentConfig;
use tokio::{
    sync::{mpsc, oneshot},
    task::JoinSet,
    time::MissedTickBehavior,
};
use tokio_util::sync::CancellationToken;
use tracing::{debug, error, info, warn};

use crate::{
    clock,
    engine::{Command, Engine, Item, ItemResult},
    ids::{ExperimentId, WorkerId},
    shared_store::SharedStore,
    store::ExperimentState,
    submission::Runnable,
};

use advance::{Advance, Advanced, Outcome};
pub use round::Round;

/// Events that wait for the loop; whoever sends more waits.
const EVENT_QUEUE_LEN: usize = 1024;
/// Genotypes of about this many bytes travel in one message.
const BATCH_LEN: usize = 1 << 20;

/// Everything that can happen.
#[derive(Debug)]
pub enum Event {
    /// A worker has introduced itself and its versions agree.
    WorkerJoined {
        /// What it calls itself.
        name: String,
        /// Items it computes at the same time.
        n_slots: usize,
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
    /// A client wants an experiment to end.
    CancelRequested {
        /// Which.
        experiment: ExperimentId,
        /// Answered when it has ended.
        reply: oneshot::Sender<()>,
    },
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
    /// An experiment's specification.
    Spec(ExperimentId, Arc<str>),
    /// Items of a generation.
    Items(ExperimentId, u64, Vec<Item>),
    /// An experiment is over.
    End(ExperimentId),
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
    tick_interval: Duration,
    workers: BTreeMap<WorkerId, ConnectedWorker>,
    experiments: BTreeMap<ExperimentId, Running>,
    n_started: u64,
    /// Judged rounds whose conclusions are being drawn and stored.
    advancing: JoinSet<Advanced>,
    /// Ends that are being stored.
    ending: JoinSet<()>,
}

struct ConnectedWorker {
    name: String,
    link: WorkerLink,
    is_draining: bool,
}

/// An experiment that has not ended.
struct Running {
    config: ExperimentConfig,
    /// Tells this run of the experiment from one before more generations were
    /// asked for.
    incarnation: u64,
    /// What is being judged; none while conclusions are drawn and stored.
    round: Option<Round>,
    /// Who waits for it to end.
    cancellations: Vec<oneshot::Sender<()>>,
}

impl Driver {
    /// A loop without workers or experiments. A worker that is silent for
    /// `lease` loses its items.
    pub fn new(
        store: SharedStore,
        events: mpsc::Receiver<Event>,
        lease: Duration,
        shutdown: CancellationToken,
    ) -> Self {
        Self {
            engine: Engine::new(clock::now(), lease),
            store,
            events,
            shutdown,
            tick_interval: lease / 8,
            workers: BTreeMap::new(),
            experiments: BTreeMap::new(),
            n_started: 0,
            advancing: JoinSet::new(),
            ending: JoinSet::new(),
        }
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
                    Err(error) => error!("storing a generation panicked: {error}; please report this"),
                },
                Some(_) = self.ending.join_next() => {}
                _ = ticks.tick() => self.engine.on_tick(clock::now()),
            }
            while let Some(command) = self.engine.poll_command() {
                self.carry_out(command);
            }
        }
        // Dropping the links ends the workers' streams.
        self.workers.clear();
        while self.advancing.join_next().await.is_some() {}
        while self.ending.join_next().await.is_some() {}
    }

    fn on_event(&mut self, event: Event) {
        let now = clock::now();
        match event {
            Event::WorkerJoined { name, n_slots, link, reply } => {
                let id = self.engine.on_worker_joined(now, &name, n_slots);
                // The worker is welcomed before it is sent work: commands are
                // carried out after this.
                self.workers
                    .insert(id, ConnectedWorker { name: name.clone(), link, is_draining: false });
                self.send(id, ToWorker::Welcome(id));
                let fleet = self.engine.fleet_size();
                info!(
                    worker = %id, name, slots = n_slots,
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
            Event::CancelRequested { experiment, reply } => self.cancel(experiment, reply),
        }
    }

    fn start(&mut self, runnable: Runnable) {
        let id = runnable.id;
        let generations = runnable.config.algorithm.generations;
        info!(
            experiment = %id, name = runnable.config.name, seed = runnable.config.seed,
            generation = runnable.round.address(), generations,
            "experiment starts"
        );
        self.engine.on_experiment_started(id, runnable.spec);
        self.n_started += 1;
        let running = Running {
            config: runnable.config,
            incarnation: self.n_started,
            round: None,
            cancellations: Vec::new(),
        };
        self.experiments.insert(id, running);
        self.judge(id, runnable.round);
    }

    /// Has the fleet judge a round.
    fn judge(&mut self, id: ExperimentId, round: Round) {
        let Some(running) = self.experiments.get_mut(&id) else { return };
        let n_trials = round.n_trials(&running.config);
        let (address, genotypes) = (round.address(), round.genotypes());
        running.round = Some(round);
        self.engine.on_generation_asked(clock::now(), id, address, genotypes, n_trials);
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::SendSpec { worker, experiment, spec } => {
                self.send(worker, ToWorker::Spec(experiment, spec));
            }
            Command::SendItems { worker, experiment, generation, items } => {
                debug!(%worker, %experiment, generation, items = items.len(), "items assigned");
                let item_len = size_of_val(items[0].genotype.as_slice()).max(1);
                for items in items.chunks((BATCH_LEN / item_len).max(1)) {
                    self.send(worker, ToWorker::Items(experiment, generation, items.to_vec()));
                }
            }
            Command::SendEnd { worker, experiment } => {
                self.send(worker, ToWorker::End(experiment));
            }
            Command::Disconnect { worker, reason, n_items_requeued } => {
                self.send(worker, ToWorker::Dropped(reason.clone()));
                self.forget_worker(worker, &reason, n_items_requeued);
            }
            Command::FinishGeneration { experiment, judged } => {
                let Some(running) = self.experiments.get_mut(&experiment) else { return };
                let Some(round) = running.round.take() else { return };
                debug!(%experiment, generation = judged.generation, "generation judged");
                let advance = Advance {
                    store: self.store.clone(),
                    shutdown: self.shutdown.clone(),
                    id: experiment,
                    incarnation: running.incarnation,
                    config: running.config.clone(),
                    round,
                    judged,
                };
                self.advancing.spawn(advance.run());
            }
            Command::FailExperiment { experiment, reason } => {
                self.end(experiment, ExperimentState::Failed, reason);
            }
        }
    }

    fn on_advanced(&mut self, advanced: Advanced) {
        let id = advanced.id;
        let Some(running) = self.experiments.get_mut(&id) else { return };
        if running.incarnation != advanced.incarnation {
            return;
        }
        match advanced.outcome {
            Outcome::Continues(round) => {
                if running.cancellations.is_empty() {
                    self.judge(id, *round);
                } else {
                    self.end(id, ExperimentState::Cancelled, CANCELLED.to_owned());
                }
            }
            Outcome::Ended => {
                self.experiments.remove(&id);
                self.engine.on_experiment_ended(id);
            }
            Outcome::Failed(reason) => self.end(id, ExperimentState::Failed, reason),
        }
    }

    fn cancel(&mut self, id: ExperimentId, reply: oneshot::Sender<()>) {
        let Some(running) = self.experiments.get_mut(&id) else {
            // It has ended, or waits for another version of the program; only
            // the store is concerned.
            self.store_end(id, ExperimentState::Cancelled, CANCELLED.to_owned(), vec![reply]);
            return;
        };
        running.cancellations.push(reply);
        // A generation that is being stored is stored first.
        if running.round.is_some() {
            self.end(id, ExperimentState::Cancelled, CANCELLED.to_owned());
        }
    }

    /// Ends an experiment that is not being advanced.
    fn end(&mut self, id: ExperimentId, state: ExperimentState, reason: String) {
        self.engine.on_experiment_ended(id);
        let replies = match self.experiments.remove(&id) {
            Some(running) => running.cancellations,
            None => Vec::new(),
        };
        match state {
            ExperimentState::Failed => error!(experiment = %id, reason, "experiment failed"),
            _ => info!(experiment = %id, reason, "experiment {}", state.name()),
        }
        self.store_end(id, state, reason, replies);
    }

    fn store_end(
        &mut self,
        id: ExperimentId,
        state: ExperimentState,
        reason: String,
        replies: Vec<oneshot::Sender<()>>,
    ) {
        let (store, shutdown) = (self.store.clone(), self.shutdown.clone());
        self.ending.spawn(async move {
            // What keeps it from being written has been logged; at the next start
            // the experiment goes on, and can be ended again.
            let _ = store
                .write(&shutdown, move |store| store.end(id, clock::unix_ms(), state, &reason))
                .await;
            for reply in replies {
                // Whoever has stopped waiting need not be told.
                let _ = reply.send(());
            }
        });
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

const CANCELLED: &str = "cancelled by a client";

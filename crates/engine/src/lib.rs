//! Schedules items on workers: a synchronous state machine.
//!
//! The caller passes every event to a handler, and then carries out the [`Command`]s that
//! [`Engine::poll_command`] returns. Time is an argument; there is no I/O, no clock and no
//! randomness, so a test can drive any fleet through any history.
//!
//! A *job* (`job.rs`) is an experiment or an evaluation. It has at most one *batch* (`batch.rs`)
//! at a time: genotypes times trials of one trial set. A batch consists of *items* (`item.rs`),
//! each one genotype and a range of trials. An item given to a worker (`worker.rs`) is an
//! *assignment*. `BatchInProgress::state` tells the state of each of its trials (`ItemState`):
//!
//! | from | to | when | in |
//! |---|---|---|---|
//! | | queued | a batch is requested | `batch.rs` |
//! | queued | assigned | it is a job's turn (`ready_queue.rs`), and a worker has room (`load_index.rs`) | `dispatch.rs` |
//! | any but done | done | a worker returns values that contradict no others, also after it was written off | `results.rs`, `known_results.rs` |
//! | assigned | queued | its worker leaves, falls silent, is faulty or stalls (`stalls.rs`); or another worker is free | `results.rs` (`on_no_result`, `requeue`), `dispatch.rs` |
//! | assigned | queued | its job is paused | `withdraw` here, `batch.rs` (`requeue_all`) |
//! | assigned | delayed | a worker is lost with it within a second of an earlier loss (`losses.rs`) | `results.rs` (`on_no_result`) |
//! | delayed | queued | the time is over | `results.rs` (`requeue_delayed`) |
//! | any but done | referred | a worker reports that it fails, or workers are lost while they compute it: the referee has to compute it | `trust/verdicts.rs` |
//! | referred | done, or queued | the referee has computed it, or could not | `trust/verdicts.rs` |
//! | done | queued | its worker is proved faulty | `trust/verdicts.rs` (`discard`) |
//!
//! Further workers get slow items as *duplicates* (`dispatch.rs`), and a second worker computes a
//! share of the done items as *audits* (`trust/`). A result counts by its place in the batch, and
//! the engine keeps the first one for each place. So the assignment of items to workers, and the
//! number of computations, cannot change the results of a batch.
//!
//! A worker's `Availability` (`availability.rs`) says whether it gets items. Worker faults never
//! fail a job: the referee's proofs settle them (`trust/`).

mod activity;
mod availability;
mod batch;
mod dispatch;
mod fleet_time;
mod in_flight;
mod instant;
mod item;
mod job;
mod known_results;
mod load_index;
mod messages;
mod name_pattern;
mod outgoing;
mod queue;
mod ready_queue;
mod referee;
mod results;
mod sanity;
mod shared_genotype;
mod stalls;
mod stats;
mod timeline;
mod trust;
mod worker;

use std::{
    collections::{BTreeMap, VecDeque},
    mem,
    sync::Arc,
    time::Duration,
};

use model::{
    ids::{AssignmentId, JobId, WorkerId},
    priority::Priority,
};
use sim_core::TrialSet;

pub use activity::{BatchActivity, EvaluationActivity, JobActivity, WithheldWorker, WorkerShare};
use availability::Obstacles;
use batch::BatchInProgress;
use fleet_time::FleetTime;
use in_flight::AssignedItem;
pub use instant::Instant;
pub use item::ItemState;
use job::JobWork;
use load_index::WorkerLoadIndex;
pub use messages::{
    Assignment, Assignments, Batch, Command, EvaluatedBatch, FleetSize, Introduction, ItemResult,
    ToWorker, WorkerStatus,
};
pub use name_pattern::NamePattern;
use outgoing::Outgoing;
use ready_queue::ReadyQueue;
pub use referee::{RefereeRequest, Verdict};
use results::NoResult;
pub use shared_genotype::SharedGenotype;
pub use stats::{Counters, FleetStats, JobStats};
use timeline::Timeline;
pub use timeline::{Fate, TimelineEntry};
pub use trust::questions::OpenQuestion;
use trust::{Trust, losses::WorkerLoss};
use worker::Worker;

/// The configuration of an engine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineConfig {
    /// A worker that is silent for this long loses its assignments.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute.
    pub audit_fraction: f64,
    /// Whether to split items by trial where that keeps slots busy.
    pub split: bool,
    /// Whether to move waiting items to idle slots, and to duplicate items in progress.
    pub duplicate: bool,
}

impl EngineConfig {
    /// The defaults: splits and duplicates items, without audits.
    pub fn new(lease: Duration) -> Self {
        Self { lease, audit_fraction: 0.0, split: true, duplicate: true }
    }
}

/// The state machine.
#[derive(Debug)]
pub struct Engine {
    config: EngineConfig,
    last_tick: Instant,
    workers: BTreeMap<WorkerId, Worker>,
    load_index: WorkerLoadIndex,
    jobs: BTreeMap<JobId, JobWork>,
    ready_queue: ReadyQueue,
    trust: Trust,
    outgoing: Outgoing,
    commands: VecDeque<Command>,
    fleet_time: FleetTime,
    counters: Counters,
    timeline: Timeline,
}

impl Engine {
    /// An engine without workers or work.
    pub fn new(now: Instant, config: EngineConfig) -> Self {
        Self {
            config,
            last_tick: now,
            workers: BTreeMap::new(),
            load_index: WorkerLoadIndex::default(),
            jobs: BTreeMap::new(),
            ready_queue: ReadyQueue::default(),
            trust: Trust::new(now),
            outgoing: Outgoing::default(),
            commands: VecDeque::new(),
            fleet_time: FleetTime::new(now),
            counters: Counters::default(),
            timeline: Timeline::default(),
        }
    }

    /// The next command, if any. Call it after every handler until it returns `None`.
    pub fn poll_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Numbers of connected workers and slots.
    pub fn fleet_size(&self) -> FleetSize {
        FleetSize { n_workers: self.workers.len(), n_slots: self.fleet_time.n_slots() }
    }

    /// The connected workers, in the order in which they joined.
    pub fn worker_status(&self, now: Instant) -> Vec<WorkerStatus> {
        self.workers.iter().map(|(&id, worker)| worker.status(id, now)).collect()
    }

    /// A worker has introduced itself.
    pub fn on_worker_joined(&mut self, now: Instant, introduction: Introduction) -> WorkerId {
        if let Some(process) = introduction.process {
            let works = self.jobs.values_mut();
            let batches = works.filter_map(|work| work.batch.as_mut());
            batches.for_each(|batch| batch.losses.on_process_joined(process));
        }
        self.counters.n_workers_joined += 1;
        let id = WorkerId(self.counters.n_workers_joined);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() + introduction.n_slots);
        let rest = self.trust.crash_loops.rest(&introduction.name);
        let quarantined = self.trust.quarantine.reason(&introduction).map(str::to_owned);
        let mut worker = Worker::new(introduction, now);
        worker.obstacles = Obstacles {
            quarantined,
            n_losses: self.trust.crash_loops.n_losses(&worker.introduction.name),
            resting_until: rest.filter(|&until| until > now && self.has_usable_worker()),
            ..Obstacles::default()
        };
        self.load_index.add(id, &worker);
        self.take_up_stranded(&worker);
        self.workers.insert(id, worker);
        self.assign(now);
        id
    }

    /// Moves jobs that had to wait for this worker to the present virtual time, so that the wait
    /// gives them no advantage.
    fn take_up_stranded(&mut self, joining: &Worker) {
        if self.workers.is_empty() {
            return;
        }
        let is_stranded = |id: &JobId| {
            let work = &self.jobs[id];
            joining.takes(work) && !self.workers.values().any(|worker| worker.takes(work))
        };
        for id in self.ready_queue.iter().filter(is_stranded).collect::<Vec<_>>() {
            if let Some(work) = self.jobs.get_mut(&id) {
                self.ready_queue.renew(id, work);
            }
        }
    }

    /// A worker's stream has ended. Its items go to other workers; returns their number.
    pub fn on_worker_left(&mut self, now: Instant, id: WorkerId) -> usize {
        let n_items_requeued = self.forget_worker(now, id, true);
        self.assign(now);
        n_items_requeued
    }

    /// A worker has sent a sign of life.
    pub fn on_heartbeat(&mut self, now: Instant, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.last_heard = now;
        }
    }

    /// A worker wants no more items. It will finish its items in progress, and leave.
    pub fn on_draining(&mut self, now: Instant, id: WorkerId) {
        self.on_heartbeat(now, id);
        if self.workers.contains_key(&id) {
            self.update_worker(id, |worker| worker.obstacles.is_draining = true);
            self.finish_evaluated(now);
        }
    }

    /// A worker has computed items.
    pub fn on_results(&mut self, now: Instant, id: WorkerId, results: Vec<ItemResult>) {
        self.on_heartbeat(now, id);
        for result in results {
            self.on_result(now, id, result);
        }
        self.assign(now);
    }

    /// A job starts. `name`: compared with the workers' patterns. `spec`: the specification,
    /// which all its items share.
    pub fn on_job_started(
        &mut self,
        now: Instant,
        id: JobId,
        name: Arc<str>,
        spec: Arc<str>,
        priority: Priority,
    ) {
        // The end of its former run may not be reported. Without an end, the ready queue and the
        // workers would keep items that the new job does not have.
        if self.jobs.contains_key(&id) {
            self.on_job_ended(now, id);
        }
        self.jobs.insert(id, JobWork::new(name, spec, priority));
    }

    /// A job requests a batch. It has no other batch in progress.
    pub fn on_batch_requested(&mut self, now: Instant, id: JobId, batch: Batch) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        assert!(work.batch.is_none(), "one batch at a time");
        self.fleet_time.advance(now);
        work.batch = Some(BatchInProgress::new(batch, now, self.fleet_time));
        self.update_readiness(id);
        self.assign(now);
    }

    /// A job is paused. The engine takes its assignments back and keeps its results.
    pub fn on_job_paused(&mut self, now: Instant, id: JobId) {
        self.pause(now, id);
        self.assign(now);
    }

    /// A paused job is resumed.
    pub fn on_job_resumed(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        work.is_paused = false;
        self.update_readiness(id);
        self.finish_evaluated(now);
        self.assign(now);
    }

    /// A job's share of the fleet changes.
    pub fn on_priority_set(&mut self, id: JobId, priority: Priority) {
        if let Some(work) = self.jobs.get_mut(&id) {
            work.priority = priority;
        }
    }

    /// A job has ended, for any reason.
    pub fn on_job_ended(&mut self, now: Instant, id: JobId) {
        self.forget_job(now, id);
        self.assign(now);
    }

    /// Time has passed. Call it several times per lease, and as often as the engine should look
    /// for late work.
    pub fn on_tick(&mut self, now: Instant) {
        let lease = self.config.lease;
        // If the coordinator itself was paused (a suspended laptop, a debugger), its workers were
        // not silent.
        let pause = now.saturating_duration_since(mem::replace(&mut self.last_tick, now));
        if pause > lease / 2 {
            self.workers.values_mut().for_each(|worker| worker.last_heard += pause);
        }
        let silent: Vec<WorkerId> = self
            .workers
            .iter()
            .filter(|(_, worker)| worker.last_heard + lease <= now)
            .map(|(&id, _)| id)
            .collect();
        for id in silent {
            // The network or a pause explains silence; no item is to blame.
            let reason = format!("silent for {} s", lease.as_secs_f64());
            let n_items_requeued = self.forget_worker(now, id, false);
            self.commands.push_back(Command::Disconnect { worker: id, reason, n_items_requeued });
        }
        self.note_auditors(now);
        self.write_off_stalled(now);
        self.requeue_delayed(now);
        self.wake_rested(now);
        self.ask_again(now);
        self.finish_evaluated(now);
        self.assign(now);
    }

    fn has_usable_worker(&self) -> bool {
        self.workers.values().any(|worker| worker.availability().is_usable())
    }

    /// Wakes workers that have rested long enough, or that are the only ones.
    fn wake_rested(&mut self, now: Instant) {
        let is_needed = !self.has_usable_worker();
        let resting = self.workers.iter().filter(|(_, worker)| {
            let resting_until = worker.obstacles.resting_until;
            resting_until.is_some_and(|until| is_needed || until <= now)
        });
        for id in resting.map(|(&id, _)| id).collect::<Vec<WorkerId>>() {
            self.update_worker(id, |worker| worker.obstacles.resting_until = None);
        }
    }

    /// Adds a job to the ready queue if it has queued items, otherwise removes it.
    fn update_readiness(&mut self, id: JobId) {
        if let Some(work) = self.jobs.get_mut(&id) {
            self.ready_queue.update(id, work);
        }
    }

    /// Replaces a job's charge for an item by the item's real duration.
    fn correct_charge(&mut self, id: JobId, charged: Duration, real: Duration) {
        if let Some(work) = self.jobs.get_mut(&id) {
            self.ready_queue.correct_charge(id, work, charged, real);
        }
    }

    /// Forgets a worker. `is_evidence`: whether its items in progress may have taken it down.
    fn forget_worker(&mut self, now: Instant, id: WorkerId, is_evidence: bool) -> usize {
        let Some(worker) = self.workers.remove(&id) else { return 0 };
        if worker.obstacles.is_draining {
            self.counters.n_workers_left += 1;
        } else {
            self.counters.n_workers_lost += 1;
            self.trust.crash_loops.on_lost(now, worker.name());
        }
        self.load_index.remove(id, &worker);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() - worker.n_slots());
        // Only items in progress can have taken it down: its oldest ones, one per slot. A worker
        // that said goodbye was not taken down.
        let n_items = worker.in_flight.len();
        let n_computing = n_items - worker.n_waiting();
        let is_evidence = is_evidence && !worker.obstacles.is_draining;
        for item in worker.in_flight.values().chain(worker.written_off.values()) {
            self.timeline.add(now, (id, &worker), item.clone(), Fate::Lost, Duration::ZERO);
        }
        let n_blamed = if is_evidence { n_computing } else { 0 };
        let process = worker.introduction.process;
        let is_alone = n_computing + worker.written_off.len() == 1;
        let loss = WorkerLoss { process, is_alone };
        if is_evidence {
            for assignment in worker.written_off.into_values() {
                self.on_written_off_lost(now, &assignment, loss);
            }
        }
        // Later items first, so that the earliest ends up at the queue's front.
        for (age_rank, (assignment_id, assignment)) in
            worker.in_flight.into_iter().enumerate().rev()
        {
            self.forget_holder(assignment_id, &assignment);
            self.correct_charge(assignment.job, assignment.charge, Duration::ZERO);
            let why = match age_rank < n_blamed {
                true => NoResult::WorkerLost(loss),
                false => NoResult::TakenBack,
            };
            self.on_no_result(now, assignment, why);
        }
        self.finish_evaluated(now);
        n_items
    }

    fn forget_job(&mut self, now: Instant, id: JobId) {
        self.withdraw_questions(id, |_| true);
        // Takes its items back, and removes it from the ready queue.
        self.pause(now, id);
        self.jobs.remove(&id);
    }

    fn pause(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        if !mem::replace(&mut work.is_paused, true) {
            self.withdraw(now, id);
        }
    }

    /// Takes a job's items back from all workers, and queues them.
    fn withdraw(&mut self, now: Instant, id: JobId) {
        let mut audits = Vec::new();
        for (&worker_id, worker) in &mut self.workers {
            worker.recalled.retain(|(_, assignment)| assignment.job != id);
            if worker.known_jobs.remove(&id).is_some() {
                self.load_index.remove(worker_id, worker);
                let is_ours = |_: &AssignmentId, item: &mut AssignedItem| item.job == id;
                let ours = worker.in_flight.remove_of(id);
                let written_off = worker.written_off.extract_if(.., is_ours).collect::<Vec<_>>();
                for (_, item) in ours.iter().chain(&written_off).cloned() {
                    let who = (worker_id, &*worker);
                    self.timeline.add(now, who, item, Fate::TakenBack, Duration::ZERO);
                }
                audits.extend(ours.into_iter().filter(|(_, a)| a.is_audit()).map(|(_, a)| a.item));
                // Results that could end its stall may be gone.
                worker.obstacles.is_stalled &= !worker.written_off.is_empty();
                self.load_index.add(worker_id, worker);
                self.commands.push_back(Command::Send(worker_id, ToWorker::End(id)));
            }
        }
        if let Some(batch) = self.batch_mut(id) {
            batch.requeue_all();
            audits.iter().for_each(|item| batch.push_audit(item));
        }
        self.update_readiness(id);
    }

    /// A job's batch in progress.
    fn batch(&self, id: JobId) -> Option<&BatchInProgress> {
        self.jobs.get(&id)?.batch.as_ref()
    }

    /// A job's batch in progress.
    fn batch_mut(&mut self, id: JobId) -> Option<&mut BatchInProgress> {
        self.jobs.get_mut(&id)?.batch.as_mut()
    }

    /// A job's batch in progress, if it has this trial set; otherwise the batch with this trial
    /// set has ended.
    fn batch_with(&self, id: JobId, trial_set: TrialSet) -> Option<&BatchInProgress> {
        self.batch(id).filter(|batch| batch.request.trial_set == trial_set)
    }

    /// A job's batch in progress, if it has this trial set; otherwise the batch with this trial
    /// set has ended.
    fn batch_with_mut(&mut self, id: JobId, trial_set: TrialSet) -> Option<&mut BatchInProgress> {
        self.batch_mut(id).filter(|batch| batch.request.trial_set == trial_set)
    }

    /// Changes a worker and updates the load index; `None` if the worker has left.
    fn update_worker<T>(
        &mut self,
        id: WorkerId,
        change: impl FnOnce(&mut Worker) -> T,
    ) -> Option<T> {
        let worker = self.workers.get_mut(&id)?;
        self.load_index.remove(id, worker);
        let result = change(worker);
        self.load_index.add(id, worker);
        Some(result)
    }
}

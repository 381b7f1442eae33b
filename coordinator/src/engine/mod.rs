//! Who computes what: a synchronous state machine.
//!
//! The shell calls a handler for everything that happens and then carries out the [`Command`]s
//! that it collects with [`Engine::poll_command`]. Time is an argument; there is no I/O, no clock
//! and no randomness, so a test can drive any fleet through any history.
//!
//! A *job* (`job.rs`) is an experiment or an evaluation. It has at most one *batch* (`batch.rs`)
//! at a time: genotypes times trials of one trial set. A batch is computed as *items*
//! (`item.rs`), each one genotype and a range of trials. An item given to a worker
//! (`worker.rs`) is an *assignment*. Items go through these states
//! (`ItemState`), in which `BatchInProgress` keeps them:
//!
//! | from | to | when | in |
//! |---|---|---|---|
//! | | queued | a batch is requested | `batch.rs` |
//! | queued | assigned | it is a job's turn (`ready_queue.rs`), and a worker has room (`load_index.rs`) | `dispatch.rs` |
//! | any but done | done | a worker returns values that contradict no others, late or not | `results.rs`, `known_results.rs` |
//! | assigned | queued | its worker leaves, falls silent, is faulty or stalls (`stalls.rs`); its job is paused; or another worker is free | `results.rs` (`retry`, `requeue`), `dispatch.rs` |
//! | assigned | delayed | two workers are lost with copies of it at the same time | `results.rs` (`retry`) |
//! | delayed | queued | the time is over | `results.rs` (`requeue_delayed`) |
//! | any but done | held | a worker says that it fails, or workers are lost with it: the referee is asked | `trust/verdicts.rs` |
//! | held | done, or queued | the referee has computed it, or knows nothing | `trust/verdicts.rs` |
//! | done | queued | its worker is proved faulty | `trust/verdicts.rs` (`discard`) |
//!
//! Beside this, slow items are assigned to further workers as *copies* (`dispatch.rs`), and a
//! share of the done items is computed by a second worker as *audits* (`trust/`). A result
//! counts by its place in the batch, and the first one for each place is kept. So who computes
//! what, and how often, cannot change the results of a batch.
//!
//! Whether a worker is given items is its `Availability` (`availability.rs`).
//! Trouble with workers is settled by proof (`trust/`), and never fails a job.

mod activity;
mod availability;
mod batch;
mod dispatch;
mod fleet_time;
mod in_flight;
mod item;
mod job;
mod known_results;
mod load_index;
mod messages;
mod name_pattern;
mod outgoing;
mod queue;
mod ready_queue;
mod results;
mod sanity;
mod stalls;
mod stats;
mod timeline;
mod trust;
mod worker;

use std::{
    collections::{BTreeMap, VecDeque},
    mem,
    sync::Arc,
    time::{Duration, Instant},
};

use sim_core::TrialSet;

use crate::{
    ids::{AssignmentId, JobId, WorkerId},
    priority::Priority,
};

pub use activity::{
    BatchActivity, EvaluationActivity, HeldItems, JobActivity, OpenQuestion, WithheldWorker,
};
use availability::Obstacles;
use batch::BatchInProgress;
use fleet_time::FleetTime;
use job::JobWork;
use load_index::WorkerLoadIndex;
pub use messages::{
    Assignment, Assignments, Batch, Command, EvaluatedBatch, FleetSize, Introduction, ItemResult,
    SharedGenotype, ToWorker, WorkerStatus,
};
pub use name_pattern::NamePattern;
use outgoing::Outgoing;
use ready_queue::ReadyQueue;
use results::NoResult;
pub use stats::{Counters, FleetStats, JobStats};
use timeline::Timeline;
pub use timeline::{Fate, TimelineEntry};
use trust::Trust;
use worker::{AssignedItem, Worker};

/// How an engine decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EngineConfig {
    /// A worker that is silent for this long loses its assignments.
    pub lease: Duration,
    /// Share of the individuals, 0 to 1, that two workers compute.
    pub audit_fraction: f64,
    /// Whether items are split by trial when that keeps slots busy.
    pub split: bool,
    /// Whether waiting items move to idle slots, and running ones are duplicated.
    pub duplicate: bool,
}

impl EngineConfig {
    /// Splits and duplicates, audits nothing.
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

    /// The next thing to do, if any. Call until there is none after every
    /// handler.
    pub fn poll_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Connected workers and slots.
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
            is_on_probation: rest.is_some(),
            resting_until: rest.filter(|&until| until > now && self.has_usable_worker()),
            ..Obstacles::default()
        };
        self.load_index.add(id, &worker);
        self.take_up_stranded(&worker);
        self.workers.insert(id, worker);
        self.assign(now);
        id
    }

    /// Jobs that only this worker takes, beside others that are there already, have saved up
    /// no time meanwhile.
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

    /// A worker's stream has ended. Its items go to others; returns their number.
    pub fn on_worker_left(&mut self, now: Instant, id: WorkerId) -> usize {
        let n_items_requeued = self.forget_worker(now, id, true);
        self.assign(now);
        n_items_requeued
    }

    /// A worker is alive.
    pub fn on_heartbeat(&mut self, now: Instant, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.last_heard = now;
        }
    }

    /// A worker wants no more items. It will finish what it computes and leave.
    pub fn on_draining(&mut self, now: Instant, id: WorkerId) {
        self.on_heartbeat(now, id);
        if self.workers.contains_key(&id) {
            self.update_worker(id, |worker| worker.obstacles.is_draining = true);
            self.finish_waived(now);
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

    /// A job exists. `name`: which workers take it, by their patterns. `spec`: what workers
    /// need beside its items.
    pub fn on_job_started(
        &mut self,
        id: JobId,
        name: Arc<str>,
        spec: Arc<str>,
        priority: Priority,
    ) {
        self.jobs.insert(id, JobWork::new(name, spec, priority));
    }

    /// A job wants a batch computed. It has no other meanwhile.
    pub fn on_batch_requested(&mut self, now: Instant, id: JobId, batch: Batch) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        assert!(work.batch.is_none(), "one batch at a time");
        self.fleet_time.advance(now);
        work.batch = Some(BatchInProgress::new(batch, now, self.fleet_time));
        self.update_readiness(id);
        self.assign(now);
    }

    /// A job waits until it is resumed. Its assignments are taken back; results are
    /// kept.
    pub fn on_job_paused(&mut self, now: Instant, id: JobId) {
        self.pause(now, id);
        self.assign(now);
    }

    /// A paused job is resumed.
    pub fn on_job_resumed(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        work.is_paused = false;
        self.update_readiness(id);
        self.finish_waived(now);
        self.assign(now);
    }

    /// A job's share of the fleet changes.
    pub fn on_priority_set(&mut self, id: JobId, priority: Priority) {
        if let Some(work) = self.jobs.get_mut(&id) {
            work.priority = priority;
        }
    }

    /// A job is over, for whatever reason.
    pub fn on_job_ended(&mut self, now: Instant, id: JobId) {
        self.forget_job(now, id);
        self.assign(now);
    }

    /// Time has passed. Call several times per lease, and as often as late work
    /// should be noticed.
    pub fn on_tick(&mut self, now: Instant) {
        let lease = self.config.lease;
        // If the coordinator itself has paused (a suspended laptop, a debugger),
        // that is not its workers' silence.
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
            // Silence is the network's fault, or a pause's, not an item's.
            let reason = format!("silent for {} s", lease.as_secs_f64());
            let n_items_requeued = self.forget_worker(now, id, false);
            self.commands.push_back(Command::Disconnect { worker: id, reason, n_items_requeued });
        }
        self.note_auditors(now);
        self.write_off_stalled(now);
        self.requeue_delayed(now);
        self.wake_rested(now);
        self.ask_again(now);
        self.finish_waived(now);
        self.assign(now);
    }

    fn has_usable_worker(&self) -> bool {
        self.workers.values().any(Worker::is_usable)
    }

    /// Gives items again to workers that have waited for long enough, or that are all there is.
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

    /// Gives a job a turn if it has something to hand out, and else none.
    fn update_readiness(&mut self, id: JobId) {
        if let Some(work) = self.jobs.get_mut(&id) {
            self.ready_queue.update(id, work);
        }
    }

    /// Replaces what a job was charged for an item by the time that the item took.
    fn correct_charge(&mut self, id: JobId, charged: Duration, real: Duration) {
        if let Some(work) = self.jobs.get_mut(&id) {
            self.ready_queue.correct_charge(id, work, charged, real);
        }
    }

    /// `is_evidence`: whether the items that the worker was computing may have taken it down.
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
        // Only what it was computing can have taken it down: its oldest items,
        // one per slot. A worker that said goodbye was not taken down.
        let n_items = worker.in_flight.len();
        let n_computing = n_items - worker.n_waiting();
        let is_evidence = is_evidence && !worker.obstacles.is_draining;
        for item in worker.in_flight.values().chain(worker.written_off.values()) {
            self.timeline.add(now, (id, &worker), item.clone(), Fate::Lost, Duration::ZERO);
        }
        let n_suspects = if is_evidence { n_computing } else { 0 };
        let process = worker.introduction.process;
        let is_alone = n_computing + worker.written_off.len() == 1;
        let lost = NoResult::WorkerLost { process, is_alone };
        if is_evidence {
            for assignment in worker.written_off.into_values() {
                self.on_written_off_lost(now, &assignment, lost);
            }
        }
        // Later items first, so that the earliest ends up at the queue's front.
        for (age_rank, (assignment_id, assignment)) in
            worker.in_flight.into_iter().enumerate().rev()
        {
            self.forget_holder(assignment_id, &assignment);
            self.correct_charge(assignment.job, assignment.charge, Duration::ZERO);
            let why = if age_rank < n_suspects { lost } else { NoResult::TakenBack };
            self.retry(now, assignment, why);
        }
        self.finish_waived(now);
        n_items
    }

    fn forget_job(&mut self, now: Instant, id: JobId) {
        self.withdraw_questions(id, |_| true);
        // A paused job has no turn.
        self.pause(now, id);
        self.jobs.remove(&id);
    }

    fn pause(&mut self, now: Instant, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        if !mem::replace(&mut work.is_paused, true) {
            self.withdraw(now, id);
        }
    }

    /// Takes a job away from all workers; its items wait again.
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
                // Nothing is left that it could answer.
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

    /// The batch that a job computes at present.
    fn batch(&self, id: JobId) -> Option<&BatchInProgress> {
        self.jobs.get(&id)?.batch.as_ref()
    }

    /// The batch that a job computes at present.
    fn batch_mut(&mut self, id: JobId) -> Option<&mut BatchInProgress> {
        self.jobs.get_mut(&id)?.batch.as_mut()
    }

    /// The same, if it is that of a trial set: else that one is over.
    fn batch_with(&self, id: JobId, trial_set: TrialSet) -> Option<&BatchInProgress> {
        self.batch(id).filter(|batch| batch.request.trial_set == trial_set)
    }

    /// The same, if it is that of a trial set: else that one is over.
    fn batch_with_mut(&mut self, id: JobId, trial_set: TrialSet) -> Option<&mut BatchInProgress> {
        self.batch_mut(id).filter(|batch| batch.request.trial_set == trial_set)
    }

    /// Changes a worker; none if it has left.
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

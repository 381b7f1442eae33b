//! Who computes what: a synchronous state machine.
//!
//! The shell calls a handler for everything that happens and then carries out
//! the [`Command`]s it collects with [`Engine::poll_command`]. Time comes in as
//! an argument; there is no I/O, no clock and no randomness, so a test can drive
//! any fleet through any history.
//!
//! A *job* is an experiment or an evaluation. It has at most one *batch* at a time:
//! genotypes times trials of one trial set. A batch is computed as *items*, each one
//! genotype and a range of trials; an item given to a worker is an *assignment*.
//!
//! The rules:
//! - A worker holds one assignment per slot, and as many ahead as it computes in
//!   some tens of milliseconds.
//! - A worker takes the jobs that its pattern of names matches; usually all.
//! - Jobs with items to hand out share the workers' time in proportion to their
//!   priorities, by stride scheduling (Waldspurger & Weihl, "Stride Scheduling:
//!   Deterministic Proportional-Share Resource Management", MIT/LCS/TM-528, 1995):
//!   a job's *virtual time* grows by the workers' time that it gets, divided by its
//!   priority, and the job with the least virtual time comes first. A job that had
//!   nothing to hand out starts again at the present virtual time, so that nobody
//!   saves up time.
//! - Near the end of a batch, and when slots would be idle, items are split by
//!   trial; when nothing is left to hand out, assigned items are duplicated if idle
//!   workers should be done sooner. The first result counts, and the other workers
//!   are told to drop the assignment.
//! - An item returns to the front of the queue when its worker leaves, falls silent, or
//!   finishes nothing for long while others do.
//! - A result counts by its place in the batch, not by its arrival, and the first
//!   one for each place is kept. So who computes what, and how often, cannot change
//!   the results of a batch.
//! - Trouble with workers is settled by proof, and never fails a job. What an item comes
//!   to is the same everywhere, so the *referee*, a process of the coordinator's, is asked
//!   (`trust`): when a worker reports a failure; when two results for the same place
//!   differ in their bits; when workers were lost again and again with the same item. If the item fails there, too, it fails its job, and no other. A worker
//!   whose word was wrong is put in quarantine, and what it computed for the batch is
//!   computed again. To find such workers, a share of the individuals can be audited:
//!   computed by a second worker, too, if there is one.

mod activity;
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
mod queue;
mod results;
mod sanity;
mod stalls;
mod stats;
mod timeline;
mod trust;
mod worker;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    mem,
    sync::Arc,
    time::{Duration, Instant},
};

use crate::{
    ids::{AssignmentId, JobId, WorkerId},
    priority::Priority,
};

pub use activity::{
    BatchActivity, EvaluationActivity, HeldItems, JobActivity, OpenQuestion, WithheldWorker,
};
use batch::BatchInProgress;
use dispatch::Outgoing;
use fleet_time::FleetTime;
use job::JobWork;
use load_index::WorkerLoadIndex;
pub use messages::{
    Assignment, Batch, Command, EvaluatedBatch, FleetSize, Introduction, ItemResult,
    SharedGenotype, WorkerStatus,
};
pub use name_pattern::NamePattern;
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
    n_workers_seen: u64,
    n_items_assigned: u64,
    workers: BTreeMap<WorkerId, Worker>,
    load_index: WorkerLoadIndex,
    jobs: BTreeMap<JobId, JobWork>,
    /// Jobs with something to hand out, by virtual time.
    ready_queue: BTreeSet<(u128, JobId)>,
    /// The present virtual time: that of the job that was given workers last. A job
    /// that comes back from waiting starts here, so that nobody saves up time.
    virtual_now: u128,
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
            n_workers_seen: 0,
            n_items_assigned: 0,
            workers: BTreeMap::new(),
            load_index: WorkerLoadIndex::default(),
            jobs: BTreeMap::new(),
            ready_queue: BTreeSet::new(),
            virtual_now: 0,
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
        self.n_workers_seen += 1;
        self.counters.n_workers_joined += 1;
        let id = WorkerId(self.n_workers_seen);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() + introduction.n_slots);
        let rest = self.trust.rest(&introduction.name);
        let mut worker = Worker::new(introduction, now);
        worker.quarantined = self.trust.quarantine_reason(&worker.introduction).map(str::to_owned);
        worker.is_on_probation = rest.is_some();
        worker.resting_until = rest.filter(|&until| until > now && self.has_usable_worker());
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
        let waiting = self.ready_queue.iter().filter(|(_, id)| {
            let work = &self.jobs[id];
            joining.takes(work) && !self.workers.values().any(|worker| worker.takes(work))
        });
        for (virtual_time, id) in waiting.copied().collect::<Vec<_>>() {
            self.ready_queue.remove(&(virtual_time, id));
            self.make_ready(id);
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
            self.update_worker(id, |worker| worker.is_draining = true);
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
        self.make_ready(id);
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
        self.make_ready(id);
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
            worker.resting_until.is_some_and(|until| is_needed || until <= now)
        });
        for id in resting.map(|(&id, _)| id).collect::<Vec<WorkerId>>() {
            self.update_worker(id, |worker| worker.resting_until = None);
        }
    }

    /// Puts a job into the ready queue or takes it out, as it has something to hand out or not.
    fn update_readiness(&mut self, id: JobId) {
        let Some(work) = self.jobs.get(&id) else { return };
        if work.is_ready() {
            self.make_ready(id);
        } else {
            self.ready_queue.remove(&(work.virtual_time, id));
        }
    }

    /// Puts a job into the ready queue, if it has something to hand out.
    fn make_ready(&mut self, id: JobId) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        if work.is_ready() && !self.ready_queue.contains(&(work.virtual_time, id)) {
            work.virtual_time = work.virtual_time.max(self.virtual_now);
            self.ready_queue.insert((work.virtual_time, id));
        }
    }

    fn correct_charge(&mut self, id: JobId, charged: Duration, real: Duration) {
        let Some(work) = self.jobs.get_mut(&id) else { return };
        let has_turn = self.ready_queue.remove(&(work.virtual_time, id));
        work.correct_charge(charged, real);
        if has_turn {
            self.ready_queue.insert((work.virtual_time, id));
        }
    }

    /// `is_evidence`: whether the items that the worker was computing may have taken it down.
    fn forget_worker(&mut self, now: Instant, id: WorkerId, is_evidence: bool) -> usize {
        let Some(worker) = self.workers.remove(&id) else { return 0 };
        if worker.is_draining {
            self.counters.n_workers_left += 1;
        } else {
            self.counters.n_workers_lost += 1;
            self.trust.on_lost(now, worker.name());
        }
        self.load_index.remove(id, &worker);
        self.fleet_time.set_slots(now, self.fleet_time.n_slots() - worker.n_slots());
        // Only what it was computing can have taken it down: its oldest items,
        // one per slot. A worker that said goodbye was not taken down.
        let n_items = worker.in_flight.len();
        let n_computing = n_items - worker.n_waiting();
        let is_evidence = is_evidence && !worker.is_draining;
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
        self.withdraw(now, id);
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
        let Some(work) = self.jobs.get_mut(&id) else { return };
        self.ready_queue.remove(&(work.virtual_time, id));
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
                audits.extend(ours.into_iter().filter(|(_, a)| a.is_audit).map(|(_, a)| a.item));
                // Nothing is left that it could answer.
                worker.is_stalled &= !worker.written_off.is_empty();
                self.load_index.add(worker_id, worker);
                self.commands.push_back(Command::SendEnd { worker: worker_id, job: id });
            }
        }
        if let Some(batch) = &mut work.batch {
            batch.requeue_all();
            audits.iter().for_each(|item| batch.push_audit(item));
        }
    }

    /// The batch that a job computes at present.
    fn batch_mut(&mut self, id: JobId) -> Option<&mut BatchInProgress> {
        self.jobs.get_mut(&id)?.batch.as_mut()
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

//! The life of runs: a synchronous state machine.
//!
//! A *run* is an experiment on its way through generations, from its submission (or the
//! coordinator's start) to its end. The driver calls a handler for every event, and then carries
//! out the [`Command`]s that [`Runs::poll_command`] returns. There is no I/O and no clock, so a
//! test can take runs through any history.
//!
//! The rules:
//! - A run is a cycle: the fleet evaluates a batch, the driver concludes it, and commits the
//!   generation while the fleet evaluates the next batch. A run commits one generation at a time.
//!   If the next generation is complete before that commit, it waits, and the fleet evaluates
//!   nothing after it. So generations are stored in order.
//! - If the coordinator dies before a generation is stored, the fleet evaluates it and the next
//!   one again, to the same bits.
//! - A run ends when its last generation is stored, when a client cancels it, or when it fails.
//!   The fleet drops its work at once. A commit in progress at that moment comes first, then the
//!   end; a generation that waits for its commit is not stored.
//! - Everything else that clients and the engine change about an experiment goes through the
//!   [`ChangeQueue`]: one write at a time per experiment, in the order in which things happened.
//!   Each client gets its answer once its change is stored.
//! - An experiment can be reopened before the end of its former run is reported here. Each run
//!   has an epoch of its own, and ignores events of other epochs.
//! - Only the last commit of a former run may still be on its way then: a client that reopens a
//!   failed or cancelled experiment waits until that end is stored and reported here
//!   ([`Request::Settle`]).
//! - Loading a run means to read its evolution from the store and to draw its first generation. A
//!   run is loaded as soon as its estimated memory fits into the budget beside the loaded runs.
//!   Until then it waits, and a notice tells its owner.
//! - After [`Runs::on_shutdown`] nothing new starts; writes in progress are finished.
//! - Evaluations, whose results are not stored, only pass through: a batch and an answer.

mod change_queue;
mod evaluations;
mod messages;
mod round;
mod run;
mod runnable;
mod stats;

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    sync::Arc,
};

use engine::EvaluatedBatch;

use crate::{
    ids::{EvaluationId, ExperimentId},
    memory::Shortage,
    store::ExperimentState,
};

pub use change_queue::{Change, PendingChange, Request, RequestId};
pub use evaluations::Evaluation;
pub use messages::{Command, CommitOutcome, RunId};
pub use round::{Next, ReadyToCommit, Round, news};
pub use runnable::Runnable;
pub use stats::RunStats;

use change_queue::ChangeQueue;
use run::{Committing, End, Run, Stage};

/// The reason of a cancelled experiment.
const CANCELLED: &str = "cancelled by a client";

/// The state machine.
#[derive(Debug)]
pub struct Runs {
    /// Bytes of memory for all loaded runs together.
    memory_budget: u64,
    runs: BTreeMap<ExperimentId, Run>,
    /// Number of runs so far; also the epoch of the latest.
    n_begun: u64,
    /// Evaluations in progress.
    evaluations: BTreeSet<EvaluationId>,
    n_evaluations: u64,
    changes: ChangeQueue,
    commands: VecDeque<Command>,
    is_stopping: bool,
}

impl Runs {
    /// A state without runs. `memory_budget`: bytes of memory for all runs together.
    pub fn new(memory_budget: u64) -> Self {
        Self {
            memory_budget,
            runs: BTreeMap::new(),
            n_begun: 0,
            evaluations: BTreeSet::new(),
            n_evaluations: 0,
            changes: ChangeQueue::default(),
            commands: VecDeque::new(),
            is_stopping: false,
        }
    }

    /// The next command, if any. Call it after every handler until it returns `None`.
    pub fn poll_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Starts a run for a stored, unfinished experiment: a new or reopened one, or one from
    /// before the coordinator's start.
    pub fn on_submitted(&mut self, runnable: Runnable) {
        let Runnable { id, config, spec, memory, latest, priority, is_paused } = runnable;
        if self.is_stopping {
            return;
        }
        self.n_begun += 1;
        let name = config.name.as_str().into();
        let run = Run::new(config, self.n_begun, latest, memory);
        let former = self.runs.insert(id, run);
        let job = id.into();
        self.commands.push_back(Command::StartJob { job, name, spec, priority, is_paused });
        self.apply_former_requests(id, former);
        self.load_what_fits();
        self.report_shortage(id);
    }

    /// Loads waiting runs as long as there is memory, the oldest first.
    fn load_what_fits(&mut self) {
        if self.is_stopping {
            return;
        }
        let mut in_use = self.memory_in_use();
        for (&id, run) in &mut self.runs {
            if run.is_waiting() && Shortage::check(run.memory, in_use, self.memory_budget).is_ok() {
                in_use += run.memory;
                run.stage = Stage::Loading;
                let generation = run.latest.as_ref().map_or(0, |latest| latest.generation + 1);
                let (config, run) = (Arc::clone(&run.config), run.id(id));
                self.commands.push_back(Command::Load { run, config, generation });
            }
        }
    }

    /// Tells the owner of a run that waits for memory.
    fn report_shortage(&mut self, id: ExperimentId) {
        let Some(shortage) = self.shortage(id) else { return };
        let reason = format!("waits for memory: {shortage}");
        self.commands.push_back(Command::PublishWait { experiment: id, shortage });
        let change = Change::Notice(reason);
        self.change(PendingChange { experiment: id, change, requests: Vec::new() });
    }

    /// The missing memory of a run that waits for memory.
    pub fn shortage(&self, id: ExperimentId) -> Option<Shortage> {
        let run = self.runs.get(&id).filter(|run| run.is_waiting())?;
        Shortage::check(run.memory, self.memory_in_use(), self.memory_budget).err()
    }

    /// Bytes that all loaded runs take.
    fn memory_in_use(&self) -> u64 {
        self.runs.values().filter(|run| run.has_memory()).map(|run| run.memory).sum()
    }

    /// A run's evolution was read from the store, or reading failed.
    pub fn on_loaded(&mut self, run_id: RunId, loaded: Result<Round, String>) {
        if self.is_stopping {
            return;
        }
        let Some(run) = self.find(run_id).filter(|run| run.end.is_none()) else { return };
        if !matches!(run.stage, Stage::Loading) {
            return;
        }
        match loaded {
            Ok(round) => self.evaluate(run_id.experiment, round),
            // Nothing is lost yet, so the run is paused until a person has looked.
            Err(reason) => {
                run.stage = Stage::Unreadable;
                self.commands.push_back(Command::PauseJob { job: run_id.experiment.into() });
                self.on_job_suspended(run_id.experiment, reason);
                self.load_what_fits();
            }
        }
    }

    /// Applies changes of the former run that are still on their way to the store; they hold for
    /// the new run, too.
    fn apply_former_requests(&mut self, id: ExperimentId, former: Option<Run>) {
        let mut end = None;
        for change in self.changes.pending(id) {
            match change {
                Change::State(ExperimentState::Running, _) => {
                    self.commands.push_back(Command::ResumeJob { job: id.into() });
                }
                Change::State(ExperimentState::Paused, _) => {
                    self.commands.push_back(Command::PauseJob { job: id.into() });
                }
                Change::State(state, reason) => {
                    end = Some(End { state: *state, reason: reason.clone() });
                }
                &Change::Priority(priority) => {
                    self.commands.push_back(Command::SetPriority { job: id.into(), priority });
                }
                Change::Notice(_) => {}
            }
        }
        for request in former.into_iter().flat_map(|former| former.cancellations) {
            self.on_request(id, Request::Cancel, request);
        }
        if let Some(end) = end {
            self.end(id, end);
        }
    }

    /// The fleet has evaluated a run's batch.
    pub fn on_batch_evaluated(&mut self, id: ExperimentId, evaluated: EvaluatedBatch) {
        if self.is_stopping {
            return;
        }
        let Some(run) = self.runs.get_mut(&id).filter(|run| run.end.is_none()) else { return };
        let Some(round) = run.take_round() else { return };
        let (config, run) = (Arc::clone(&run.config), run.id(id));
        self.commands.push_back(Command::Conclude { run, config, round, evaluated });
    }

    /// A round was concluded, or concluding failed.
    pub fn on_concluded(&mut self, run_id: RunId, conclusion: Result<Next, String>) {
        if self.is_stopping {
            return;
        }
        let Some(run) = self.find(run_id).filter(|run| run.end.is_none()) else { return };
        match conclusion {
            Ok(Next::Evaluate(round)) => self.evaluate(run_id.experiment, *round),
            Ok(Next::Commit(ready)) => {
                run.stage = Stage::ReadyToCommit(ready);
                self.commit_next(run_id.experiment);
            }
            Err(reason) => {
                self.end(run_id.experiment, End { state: ExperimentState::Failed, reason });
            }
        }
    }

    /// A commit has ended.
    pub fn on_committed(&mut self, run_id: RunId, outcome: CommitOutcome) {
        let id = run_id.experiment;
        let Some(run) = self.find(run_id) else { return };
        let Some(Committing { generation, is_last }) = run.committing.take() else { return };
        let is_stored = matches!(outcome, CommitOutcome::Stored);
        if is_stored {
            run.latest = Some(generation);
        }
        if let Some(end) = run.end.take() {
            return self.finish(id, end);
        }
        match outcome {
            CommitOutcome::Stored if !is_last => self.commit_next(id),
            // The store has the whole state.
            CommitOutcome::Stored | CommitOutcome::NotWanted => {
                self.runs.remove(&id);
                self.commands.push_back(Command::EndJob { job: id.into() });
                self.load_what_fits();
            }
            CommitOutcome::Failed(reason) => {
                self.end(id, End { state: ExperimentState::Failed, reason });
            }
        }
    }

    /// The fleet cannot compute a run's batch; the engine has ended the job.
    pub fn on_job_failed(&mut self, id: ExperimentId, reason: String) {
        if self.runs.contains_key(&id) {
            self.end(id, End { state: ExperimentState::Failed, reason });
        }
    }

    /// A person has to look at a run before it continues; the engine has paused the job.
    pub fn on_job_suspended(&mut self, id: ExperimentId, reason: String) {
        let paused = Change::State(ExperimentState::Paused, reason.clone());
        for change in [Change::Notice(reason), paused] {
            self.change(PendingChange { experiment: id, change, requests: Vec::new() });
        }
    }

    /// A client wants to change an experiment. An experiment without a run has ended, or waits
    /// for another version of the program, so only the store changes.
    pub fn on_request(&mut self, id: ExperimentId, request: Request, request_id: RequestId) {
        let run = self.runs.get_mut(&id);
        let is_active = run.as_ref().is_some_and(|run| run.end.is_none());
        let (change, command) = match request {
            Request::Cancel => {
                let end = End { state: ExperimentState::Cancelled, reason: CANCELLED.to_owned() };
                if let Some(run) = run {
                    run.cancellations.push(request_id);
                    return self.end(id, end);
                }
                (Change::State(end.state, end.reason), None)
            }
            Request::Pause(reason) => {
                let command = Command::PauseJob { job: id.into() };
                (Change::State(ExperimentState::Paused, reason), Some(command))
            }
            Request::Resume => {
                if let Some(run) = run
                    && matches!(run.stage, Stage::Unreadable)
                {
                    run.stage = Stage::Waiting;
                }
                let command = Command::ResumeJob { job: id.into() };
                (Change::State(ExperimentState::Running, String::new()), Some(command))
            }
            Request::SetPriority(priority) => {
                let command = Command::SetPriority { job: id.into(), priority };
                (Change::Priority(priority), Some(command))
            }
            Request::Settle => {
                if !self.changes.join(id, request_id) {
                    let is_stored = true;
                    self.commands.push_back(Command::Answer { request: request_id, is_stored });
                }
                return;
            }
        };
        self.commands.extend(command.filter(|_| is_active));
        self.load_what_fits();
        self.change(PendingChange { experiment: id, change, requests: vec![request_id] });
    }

    /// The write of a change has ended. `is_stored`: false if the coordinator stopped before the
    /// write.
    pub fn on_change_written(&mut self, id: ExperimentId, is_stored: bool) {
        let (requests, next) = self.changes.on_written(id);
        for request in requests {
            self.commands.push_back(Command::Answer { request, is_stored });
        }
        self.write(id, next);
    }

    /// The coordinator stops: nothing new starts.
    pub fn on_shutdown(&mut self) {
        self.is_stopping = true;
    }

    fn find(&mut self, RunId { experiment, run_epoch }: RunId) -> Option<&mut Run> {
        self.runs.get_mut(&experiment).filter(|run| run.run_epoch == run_epoch)
    }

    /// Has the fleet evaluate a batch for a run.
    fn evaluate(&mut self, id: ExperimentId, round: Round) {
        let Some(run) = self.runs.get_mut(&id) else { return };
        let batch = round.batch(&run.config);
        self.commands.push_back(Command::Evaluate { job: id.into(), batch });
        run.stage = Stage::Evaluating(round);
    }

    /// Commits the next complete generation, if the previous one is stored, and has the fleet
    /// evaluate the one after it meanwhile.
    fn commit_next(&mut self, id: ExperimentId) {
        let is_stopping = self.is_stopping;
        let Some(run) = self.runs.get_mut(&id) else { return };
        if run.committing.is_some() || is_stopping {
            return;
        }
        let Some(mut ready) = run.take_ready() else { return };
        run.committing = Some(Committing {
            generation: ready.generation.clone(),
            is_last: ready.completed.is_some(),
        });
        let next = ready.next.take();
        let link = next.as_ref().and_then(Round::link);
        let (config, run) = (Arc::clone(&run.config), run.id(id));
        self.commands.push_back(Command::Commit { run, config, ready, link });
        if let Some(round) = next {
            self.evaluate(id, round);
        }
    }

    /// Ends a run, after a commit in progress.
    fn end(&mut self, id: ExperimentId, end: End) {
        let Some(run) = self.runs.get_mut(&id) else { return };
        if run.end.is_none() {
            self.commands.push_back(Command::EndJob { job: id.into() });
        }
        if run.committing.is_some() {
            run.end.get_or_insert(end);
        } else {
            self.finish(id, end);
        }
    }

    /// Forgets a run and stores its end. If its last generation was stored meanwhile, the
    /// experiment is completed, and the store keeps that state.
    fn finish(&mut self, id: ExperimentId, End { state, reason }: End) {
        let Some(run) = self.runs.remove(&id) else { return };
        let (experiment, requests) = (id, run.cancellations);
        self.commands.push_back(Command::PublishEnd { experiment, state, reason: reason.clone() });
        let change = Change::State(state, reason);
        self.change(PendingChange { experiment, change, requests });
        self.load_what_fits();
    }

    /// Stores a change after all earlier ones.
    fn change(&mut self, pending: PendingChange) {
        let id = pending.experiment;
        let to_write = self.changes.push(pending);
        self.write(id, to_write);
    }

    fn write(&mut self, experiment: ExperimentId, change: Option<Change>) {
        self.commands.extend(change.map(|change| Command::WriteChange { experiment, change }));
    }
}

#[cfg(test)]
mod tests;

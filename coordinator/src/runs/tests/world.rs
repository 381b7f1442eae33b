//! A simulated environment for runs: a store, a fleet and clients, each as slow as a test wants.
//! It checks all commands of the runs against the rules.

use std::{collections::BTreeMap, time::Duration};

use engine::Batch;
use evolution::{Evolution, Population};
use experiment_file::ExperimentConfig;
use sim_core::TrialSet;

use super::super::*;
use crate::{ids::JobId, priority::Priority, store::GenerationRecord};

/// Runs and their environment.
pub struct World {
    pub runs: Runs,
    pub store: BTreeMap<ExperimentId, Stored>,
    /// The engine's jobs.
    pub jobs: BTreeMap<ExperimentId, Job>,
    pub loads: Vec<RunId>,
    pub conclusions: Vec<(RunId, Arc<ExperimentConfig>, Round, EvaluatedBatch)>,
    pub commits: Vec<CommitTask>,
    pub changes: Vec<ChangeTask>,
    /// All requests; after an answer, whether the change is stored.
    pub answers: BTreeMap<RequestId, Option<bool>>,
}

/// Bytes per run; there is memory for two.
const MEMORY: u64 = 5;
const MEMORY_BUDGET: u64 = 2 * MEMORY + 1;

/// A stored experiment.
pub struct Stored {
    pub config: ExperimentConfig,
    pub state: ExperimentState,
    pub evolution: Evolution,
    pub latest: Option<GenerationRecord>,
    pub priority: Priority,
}

/// A job of the engine.
pub struct Job {
    pub is_paused: bool,
    pub batch: Option<(Population, u32)>,
}

/// A commit under way.
pub struct CommitTask {
    pub run: RunId,
    pub ready: Box<ReadyToCommit>,
    /// `None` while the disk is busy with it.
    pub outcome: Option<CommitOutcome>,
}

/// The write of a change under way.
pub struct ChangeTask {
    pub experiment: ExperimentId,
    pub change: Change,
    /// `None` while the disk is busy with it; then whether it is stored.
    pub outcome: Option<bool>,
}

impl Stored {
    /// Completed generations.
    pub fn n_done(&self) -> u64 {
        self.latest.as_ref().map_or(0, |latest| latest.generation + 1)
    }
}

/// A small experiment: four individuals of three genes, re-evaluations after every
/// other generation.
pub fn config(seed: u64, generations: u64) -> ExperimentConfig {
    let file = include_str!("../../../../configs/quickstart.json");
    let (mut config, _) = ExperimentConfig::from_json(file, "", evolution::ALGORITHMS).unwrap();
    config.seed = seed;
    config.algorithm.generations = generations;
    config.algorithm.population_size = 4;
    config.algorithm.num_evaluations = 1;
    config.algorithm.champion_every = 2;
    config.algorithm.champion_trials = 2;
    config.algorithm.judgement_trials = 3;
    config
}

/// Evolution before its first generation.
pub fn evolution(config: &ExperimentConfig) -> Evolution {
    Evolution::new(config, std::slice::from_ref(&(0..3)), "test")
}

/// The fleet's results for a batch: deterministic, with so little noise that no candidates are
/// close.
pub fn evaluated(genotypes: &[Vec<f64>], n_trials: u32) -> EvaluatedBatch {
    let fitness = |genes: &Vec<f64>| {
        (0..n_trials).map(|trial| genes.iter().sum::<f64>() + 1e-6 * f64::from(trial)).collect()
    };
    EvaluatedBatch {
        trial_set: TrialSet::Generation(0),
        values: genotypes.iter().map(fitness).collect(),
        duration: Duration::from_millis(1),
        n_workers: 1,
        idle_share: 0.0,
        n_audited: 0,
        n_unaudited: 0,
        notices: Vec::new(),
    }
}

/// Evolution after `n_generations` undisturbed generations.
pub fn undisturbed(config: &ExperimentConfig, n_generations: u64) -> Evolution {
    let mut current = evolution(config);
    let mut longer = config.clone();
    longer.algorithm.generations = u64::MAX;
    while current.n_generations() < n_generations {
        let mut round = Round::generation(current.clone());
        current = loop {
            let batch = round.batch(&longer);
            let fitness = evaluated(&batch.genotypes, batch.n_trials);
            match round.conclude(&longer, &fitness).unwrap() {
                Next::Evaluate(next) => round = *next,
                Next::Commit(ready) => break Arc::unwrap_or_clone(ready.evolution),
            }
        };
    }
    current
}

fn experiment(job: JobId) -> ExperimentId {
    job.experiment().expect("no test requests an evaluation")
}

impl World {
    pub fn new() -> Self {
        Self {
            runs: Runs::new(MEMORY_BUDGET),
            store: BTreeMap::new(),
            jobs: BTreeMap::new(),
            loads: Vec::new(),
            conclusions: Vec::new(),
            commits: Vec::new(),
            changes: Vec::new(),
            answers: BTreeMap::new(),
        }
    }

    /// A client submits an experiment, which is stored and then runs.
    pub fn submit(&mut self, generations: u64) -> ExperimentId {
        let id = ExperimentId(self.store.len() as u64 + 1);
        let config = config(id.0, generations);
        let stored = Stored {
            state: ExperimentState::Running,
            evolution: evolution(&config),
            latest: None,
            priority: Priority::default(),
            config,
        };
        self.store.insert(id, stored);
        self.run(id);
        id
    }

    /// A client extends a completed experiment, or resumes one that failed or was cancelled.
    pub fn reopen(&mut self, id: ExperimentId) {
        let stored = self.store.get_mut(&id).unwrap();
        assert!(!stored.state.is_unfinished());
        if stored.state == ExperimentState::Completed {
            stored.config.algorithm.generations += 2;
        }
        stored.state = ExperimentState::Running;
        self.run(id);
    }

    /// Whether a client may reopen an experiment: its former end is settled.
    pub fn can_be_reopened(&self, id: ExperimentId) -> bool {
        match self.store[&id].state {
            ExperimentState::Completed => true,
            state => !state.is_unfinished() && self.runs.changes.pending(id).next().is_none(),
        }
    }

    fn run(&mut self, id: ExperimentId) {
        let Stored { config, state, latest, priority, .. } = &self.store[&id];
        let runnable = Runnable {
            latest: latest.clone(),
            is_paused: *state == ExperimentState::Paused,
            memory: MEMORY,
            ..Runnable::new(id, config.clone(), 3, *priority)
        };
        self.runs.on_submitted(runnable);
        self.carry_out();
    }

    pub fn request(&mut self, id: ExperimentId, request: Request) -> RequestId {
        let request_id = RequestId(self.answers.len() as u64);
        self.answers.insert(request_id, None);
        self.runs.on_request(id, request, request_id);
        self.carry_out();
        request_id
    }

    /// A run's evolution is read from the store.
    pub fn finish_load(&mut self, i: usize) {
        let run = self.loads.remove(i);
        let evolution = self.store[&run.experiment].evolution.clone();
        self.runs.on_loaded(run, Ok(Round::generation(evolution)));
        self.carry_out();
    }

    /// The fleet finishes a job's batch. Returns the number of its genotypes.
    pub fn finish_batch(&mut self, id: ExperimentId) -> Option<usize> {
        let (genotypes, n_trials) = self.jobs.get_mut(&id)?.batch.take()?;
        self.runs.on_batch_evaluated(id, evaluated(&genotypes, n_trials));
        self.carry_out();
        Some(genotypes.len())
    }

    /// A conclusion ends.
    pub fn finish_conclusion(&mut self, i: usize) {
        let (run, config, round, evaluated) = self.conclusions.remove(i);
        let conclusion = round.conclude(&config, &evaluated).map_err(|error| error.to_string());
        self.runs.on_concluded(run, conclusion);
        self.carry_out();
    }

    /// The disk finishes a commit; the driver does not know yet.
    pub fn write_commit(&mut self, i: usize) {
        let CommitTask { run, ready, outcome } = &mut self.commits[i];
        if outcome.is_some() {
            return;
        }
        let stored = self.store.get_mut(&run.experiment).unwrap();
        assert!(stored.state.is_unfinished(), "nothing is committed after the end");
        assert_eq!(ready.generation.generation, stored.n_done(), "in order, and once");
        stored.latest = Some(ready.generation.clone());
        stored.evolution = (*ready.evolution).clone();
        if ready.completed.is_some() {
            stored.state = ExperimentState::Completed;
        }
        *outcome = Some(CommitOutcome::Stored);
    }

    /// A commit fails.
    pub fn fail_commit(&mut self, i: usize, failure: CommitOutcome) {
        self.commits[i].outcome.get_or_insert(failure);
    }

    /// The driver learns of a commit's outcome, if there is one.
    pub fn report_commit(&mut self, i: usize) {
        if self.commits[i].outcome.is_some() {
            let CommitTask { run, outcome, .. } = self.commits.remove(i);
            self.runs.on_committed(run, outcome.unwrap());
            self.carry_out();
        }
    }

    /// The disk finishes a change; the driver does not know yet.
    pub fn write_change(&mut self, i: usize) {
        let ChangeTask { experiment, change, outcome } = &mut self.changes[i];
        if outcome.is_some() {
            return;
        }
        let stored = self.store.get_mut(experiment).unwrap();
        match change {
            Change::State(state, _) if stored.state.is_unfinished() => stored.state = *state,
            Change::Priority(priority) if stored.state.is_unfinished() => {
                stored.priority = *priority;
            }
            _ => {}
        }
        *outcome = Some(true);
    }

    /// The driver learns that a change is stored, if it is.
    pub fn report_change(&mut self, i: usize) {
        if let Some(is_stored) = self.changes[i].outcome {
            let ChangeTask { experiment, .. } = self.changes.remove(i);
            self.runs.on_change_written(experiment, is_stored);
            self.carry_out();
        }
    }

    /// The engine gives a job up.
    pub fn fail_job(&mut self, id: ExperimentId) {
        if self.jobs.get(&id).is_some_and(|job| job.batch.is_some()) {
            self.jobs.remove(&id);
            self.runs.on_job_failed(id, "its items fail".to_owned());
            self.carry_out();
        }
    }

    /// The engine pauses a job.
    pub fn suspend_job(&mut self, id: ExperimentId) {
        let Some(job) = self.jobs.get_mut(&id).filter(|job| job.batch.is_some()) else { return };
        job.is_paused = true;
        self.runs.on_job_suspended(id, "two workers differ".to_owned());
        self.carry_out();
    }

    /// The coordinator is killed and restarted. Everything written is still there.
    pub fn crash(&mut self) {
        self.runs = Runs::new(MEMORY_BUDGET);
        self.jobs.clear();
        self.loads.clear();
        self.conclusions.clear();
        self.commits.clear();
        self.changes.clear();
        // Their connections break.
        for answer in self.answers.values_mut() {
            answer.get_or_insert(false);
        }
        let unfinished = self.store.iter().filter(|(_, stored)| stored.state.is_unfinished());
        for id in unfinished.map(|(&id, _)| id).collect::<Vec<_>>() {
            self.run(id);
        }
    }

    /// The coordinator is stopped and restarted. `is_disk_good`: whether pending writes still
    /// succeed.
    pub fn stop(&mut self, is_disk_good: bool) {
        self.runs.on_shutdown();
        while !self.commits.is_empty() || !self.changes.is_empty() {
            if !self.commits.is_empty() {
                if is_disk_good {
                    self.write_commit(0);
                }
                self.fail_commit(0, CommitOutcome::NotWanted);
                self.report_commit(0);
            }
            if !self.changes.is_empty() {
                if is_disk_good {
                    self.write_change(0);
                }
                self.changes[0].outcome.get_or_insert(false);
                self.report_change(0);
            }
        }
        assert!(self.answers.values().all(Option::is_some), "nobody waits for ever");
        self.crash();
    }

    /// Finishes all pending work, except that of paused jobs.
    pub fn settle(&mut self) {
        loop {
            let mut jobs = self.jobs.iter().filter(|(_, job)| !job.is_paused);
            let busy = jobs.find(|(_, job)| job.batch.is_some()).map(|(&id, _)| id);
            if !self.loads.is_empty() {
                self.finish_load(0);
            } else if !self.conclusions.is_empty() {
                self.finish_conclusion(0);
            } else if !self.commits.is_empty() {
                self.write_commit(0);
                self.report_commit(0);
            } else if !self.changes.is_empty() {
                self.write_change(0);
                self.report_change(0);
            } else if let Some(id) = busy {
                self.finish_batch(id);
            } else {
                return;
            }
        }
    }

    /// Carries out the test's commands, and everything that follows.
    pub fn settle_after_commands(&mut self) {
        self.carry_out();
        self.settle();
        self.check_settled();
    }

    /// Checks the invariants that hold when no work is pending.
    pub fn check_settled(&self) {
        assert!(self.answers.values().all(Option::is_some), "every client is answered");
        let unfinished = self.store.iter().filter(|(_, stored)| stored.state.is_unfinished());
        let unfinished: Vec<_> = unfinished.map(|(&id, _)| id).collect();
        assert_eq!(self.runs.runs.keys().copied().collect::<Vec<_>>(), unfinished);
        assert_eq!(self.jobs.keys().copied().collect::<Vec<_>>(), unfinished);
        for (id, stored) in &self.store {
            let is_paused = stored.state == ExperimentState::Paused;
            if let Some(job) = self.jobs.get(id) {
                assert_eq!(is_paused, job.is_paused);
                let is_waiting = self.runs.runs[id].is_waiting();
                assert!(is_paused || is_waiting, "no run that can continue has stopped");
                assert!(
                    !is_waiting || self.n_loaded() == 2,
                    "runs wait only if the memory is full"
                );
            }
            assert_eq!(
                stored.evolution,
                undisturbed(&stored.config, stored.n_done()),
                "experiment {id} has the state of an undisturbed run"
            );
        }
    }

    /// The number of runs that take memory.
    fn n_loaded(&self) -> usize {
        self.runs.runs.values().filter(|run| run.has_memory()).count()
    }

    /// Carries out commands, and checks each.
    fn carry_out(&mut self) {
        while let Some(command) = self.runs.poll_command() {
            self.carry_out_one(command);
        }
    }

    fn carry_out_one(&mut self, command: Command) {
        match command {
            Command::StartJob { job, is_paused, .. } => {
                self.jobs.insert(experiment(job), Job { is_paused, batch: None });
            }
            Command::Load { run, generation, .. } => {
                assert_eq!(generation, self.store[&run.experiment].n_done());
                assert!(self.n_loaded() <= 2, "there is memory for two");
                self.loads.push(run);
            }
            Command::Evaluate { job, batch: Batch { genotypes, n_trials, .. } } => {
                let id = experiment(job);
                assert!(self.store[&id].state.is_unfinished(), "it has not ended");
                let job = self.jobs.get_mut(&id).expect("the engine knows it");
                assert!(job.batch.is_none(), "one batch at a time");
                job.batch = Some((genotypes, n_trials));
            }
            Command::PauseJob { job } => {
                self.jobs.get_mut(&experiment(job)).unwrap().is_paused = true
            }
            Command::ResumeJob { job } => {
                self.jobs.get_mut(&experiment(job)).unwrap().is_paused = false
            }
            Command::SetPriority { job, .. } => assert!(self.jobs.contains_key(&experiment(job))),
            Command::EndJob { job } => drop(self.jobs.remove(&experiment(job))),
            Command::Conclude { run, config, round, evaluated } => {
                self.conclusions.push((run, config, round, evaluated));
            }
            Command::Commit { run, ready, .. } => {
                let mut others = self.commits.iter().map(|task| task.run);
                assert!(!others.any(|other| other == run), "one commit at a time");
                let stored = &self.store[&run.experiment];
                assert!(stored.state.is_unfinished(), "nothing is committed after the end");
                assert_eq!(ready.generation.generation, stored.n_done(), "in order, and once");
                self.commits.push(CommitTask { run, ready, outcome: None });
            }
            Command::WriteChange { experiment: id, change } => {
                let mut others = self.changes.iter().map(|task| task.experiment);
                assert!(!others.any(|other| other == id), "one change at a time");
                if let Change::State(state, _) = &change
                    && !state.is_unfinished()
                {
                    let busy = |task: &CommitTask| task.outcome.is_none();
                    let mut commits = self.commits.iter().filter(|task| busy(task));
                    let is_first = !commits.any(|task| task.run.experiment == id);
                    assert!(is_first, "a commit in progress comes first");
                    assert!(!self.jobs.contains_key(&id), "the fleet has dropped it");
                }
                self.changes.push(ChangeTask { experiment: id, change, outcome: None });
            }
            Command::Answer { request, is_stored } => {
                let answer = self.answers.get_mut(&request).expect("somebody asked");
                assert!(answer.replace(is_stored).is_none(), "one answer each");
            }
            Command::PublishWait { experiment, .. } => {
                assert!(self.runs.runs[&experiment].is_waiting());
            }
            Command::PublishEnd { state, .. } => assert!(!state.is_unfinished()),
            Command::AnswerEvaluation { .. } => unreachable!("no test requests an evaluation"),
        }
    }
}

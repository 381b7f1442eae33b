//! A fleet of fake workers in virtual time.

use std::time::{Duration, Instant};

use evolution::Population;
use sim_core::Output;
use swarm_proto::ITEMS_PER_SLOT_MAX;

use super::{super::*, LEASE};
use crate::ids::AssignmentId;

/// A fleet in virtual time: carries out the engine's commands on fake workers,
/// whose fitness is a function of genotype and trial.
pub(super) struct Fleet {
    pub(super) engine: Engine,
    pub(super) now: Instant,
    pub(super) workers: BTreeMap<WorkerId, FakeWorker>,
    pub(super) evaluated: Vec<(JobId, EvaluatedBatch)>,
    pub(super) failed: Vec<(JobId, String)>,
    pub(super) paused: Vec<(JobId, String)>,
    pub(super) n_items_sent: usize,
    /// What workers say that an item took.
    pub(super) compute_time: Duration,
    /// What workers say that their numbers are.
    pub(super) output: Output,
}

#[derive(Default)]
pub(super) struct FakeWorker {
    pub(super) specs: BTreeSet<JobId>,
    pub(super) assignments: VecDeque<(JobId, Assignment)>,
}

pub(super) fn fitness(genotype: &[f64], trial: u32) -> f64 {
    genotype[0] * 1000.0 + f64::from(trial)
}

pub(super) fn genotypes(n: usize) -> Population {
    (0..n).map(|i| vec![i as f64]).collect()
}

pub(super) fn introduction(n_slots: usize) -> Introduction {
    Introduction { name: "fake".to_owned(), version: String::new(), n_slots, process: None }
}

impl Fleet {
    pub(super) fn new() -> Self {
        Self::with(EngineConfig::new(LEASE))
    }

    /// Its engine neither splits nor duplicates, so that items can be counted.
    pub(super) fn plain() -> Self {
        Self::with(EngineConfig { split: false, duplicate: false, ..EngineConfig::new(LEASE) })
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "any instant will do as the origin of virtual time"
    )]
    pub(super) fn with(config: EngineConfig) -> Self {
        let now = Instant::now();
        Self {
            engine: Engine::new(now, config),
            now,
            workers: BTreeMap::new(),
            evaluated: Vec::new(),
            failed: Vec::new(),
            paused: Vec::new(),
            n_items_sent: 0,
            compute_time: Duration::from_millis(10),
            output: Output::Fitness,
        }
    }

    pub(super) fn start(&mut self, id: JobId, n_individuals: usize, n_trials: u32) {
        self.engine.on_job_started(id, "spec".into(), Priority::default());
        self.ask(id, 0, n_individuals, n_trials);
    }

    pub(super) fn ask(&mut self, id: JobId, generation: u64, n_individuals: usize, n_trials: u32) {
        let genotypes = genotypes(n_individuals);
        let batch = Batch::fitness(TrialSet::Generation(generation), genotypes, n_trials);
        self.engine.on_batch_requested(self.now, id, batch);
        self.carry_out();
    }

    pub(super) fn join(&mut self, n_slots: usize) -> WorkerId {
        let id = self.engine.on_worker_joined(self.now, introduction(n_slots));
        self.workers.insert(id, FakeWorker::default());
        self.carry_out();
        id
    }

    pub(super) fn kill(&mut self, id: WorkerId) {
        self.workers.remove(&id);
        self.engine.on_worker_left(self.now, id);
        self.carry_out();
    }

    /// The worker's oldest item is computed.
    pub(super) fn step(&mut self, id: WorkerId) -> bool {
        let Some((_, assignment)) =
            self.workers.get_mut(&id).and_then(|w| w.assignments.pop_front())
        else {
            return false;
        };
        let fitness =
            assignment.trials.clone().map(|trial| fitness(&assignment.genotype, trial)).collect();
        self.answer(id, assignment.id, Ok(fitness));
        true
    }

    pub(super) fn answer(
        &mut self,
        worker: WorkerId,
        assignment: AssignmentId,
        outcome: Result<Vec<f64>, String>,
    ) {
        let result = ItemResult {
            id: assignment,
            output: self.output,
            outcome,
            compute_time: self.compute_time,
        };
        self.engine.on_results(self.now, worker, vec![result]);
        self.carry_out();
    }

    pub(super) fn carry_out(&mut self) {
        while let Some(command) = self.engine.poll_command() {
            match command {
                Command::SendSpec { worker, job, .. } => {
                    let is_new = self.workers.get_mut(&worker).unwrap().specs.insert(job);
                    assert!(is_new, "a specification is sent once");
                }
                Command::SendAssignments { worker, job, assignments, .. } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    assert!(worker.specs.contains(&job), "the specification comes first");
                    self.n_items_sent += assignments.len();
                    worker
                        .assignments
                        .extend(assignments.into_iter().map(|assignment| (job, assignment)));
                }
                Command::SendEnd { worker, job } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    worker.specs.remove(&job);
                    worker.assignments.retain(|(of, _)| *of != job);
                }
                Command::Disconnect { worker, .. } => {
                    self.workers.remove(&worker);
                }
                Command::FinishBatch { job, evaluated } => {
                    self.evaluated.push((job, evaluated));
                }
                Command::SendDrop { worker, assignments } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    worker
                        .assignments
                        .retain(|(_, assignment)| !assignments.contains(&assignment.id));
                }
                Command::PauseJob { job, reason } => {
                    self.paused.push((job, reason));
                }
                Command::FailJob { job, reason } => {
                    self.failed.push((job, reason));
                }
            }
        }
        self.engine.sanity_check();
        for (id, worker) in &self.workers {
            let n_slots = self.engine.workers[id].n_slots();
            assert!(
                worker.assignments.len() <= ITEMS_PER_SLOT_MAX * n_slots,
                "credits are respected"
            );
        }
    }

    /// Lets every worker compute until nothing is left.
    pub(super) fn run(&mut self) {
        let ids: Vec<WorkerId> = self.workers.keys().copied().collect();
        loop {
            let n_steps = ids.iter().filter(|&&id| self.step(id)).count();
            if n_steps == 0 {
                return;
            }
        }
    }

    pub(super) fn assert_evaluated(&self, n_individuals: usize, n_trials: u32) {
        let (_, evaluated) = &self.evaluated[0];
        let expected: Vec<Vec<f64>> = genotypes(n_individuals)
            .iter()
            .map(|genotype| (0..n_trials).map(|trial| fitness(genotype, trial)).collect())
            .collect();
        assert_eq!(evaluated.values, expected);
        assert_eq!(self.evaluated.len(), 1, "a batch is evaluated once");
    }
}

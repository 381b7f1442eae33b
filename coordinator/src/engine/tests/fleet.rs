//! A fleet of fake workers in virtual time.

use std::time::{Duration, Instant};

use swarm_proto::ITEMS_PER_SLOT_MAX;

use super::{super::*, LEASE};
use crate::ids::ItemId;

/// A fleet in virtual time: carries out the engine's commands on fake workers,
/// whose fitness is a function of genotype and trial.
pub(super) struct Fleet {
    pub(super) engine: Engine,
    pub(super) now: Instant,
    pub(super) workers: BTreeMap<WorkerId, FakeWorker>,
    pub(super) judged: Vec<(ExperimentId, JudgedGeneration)>,
    pub(super) failed: Vec<(ExperimentId, String)>,
    pub(super) paused: Vec<(ExperimentId, String)>,
    pub(super) n_items_sent: usize,
    /// What workers say that an item took.
    pub(super) compute_time: Duration,
}

#[derive(Default)]
pub(super) struct FakeWorker {
    pub(super) specs: BTreeSet<ExperimentId>,
    pub(super) items: VecDeque<(ExperimentId, Item)>,
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
            judged: Vec::new(),
            failed: Vec::new(),
            paused: Vec::new(),
            n_items_sent: 0,
            compute_time: Duration::from_millis(10),
        }
    }

    pub(super) fn start(&mut self, id: ExperimentId, n_individuals: usize, n_trials: u32) {
        self.engine.on_experiment_started(id, "spec".into(), Priority::default());
        self.ask(id, 0, n_individuals, n_trials);
    }

    pub(super) fn ask(
        &mut self,
        id: ExperimentId,
        generation: u64,
        n_individuals: usize,
        n_trials: u32,
    ) {
        let genotypes = genotypes(n_individuals);
        self.engine.on_generation_asked(self.now, id, generation, genotypes, n_trials);
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
        let Some((_, item)) = self.workers.get_mut(&id).and_then(|w| w.items.pop_front()) else {
            return false;
        };
        let fitness = item.trials.clone().map(|trial| fitness(&item.genotype, trial)).collect();
        self.answer(id, item.id, Ok(fitness));
        true
    }

    pub(super) fn answer(
        &mut self,
        worker: WorkerId,
        item: ItemId,
        outcome: Result<Vec<f64>, String>,
    ) {
        let result = ItemResult { id: item, outcome, compute_time: self.compute_time };
        self.engine.on_results(self.now, worker, vec![result]);
        self.carry_out();
    }

    pub(super) fn carry_out(&mut self) {
        while let Some(command) = self.engine.poll_command() {
            match command {
                Command::SendSpec { worker, experiment, .. } => {
                    let is_new = self.workers.get_mut(&worker).unwrap().specs.insert(experiment);
                    assert!(is_new, "a specification is sent once");
                }
                Command::SendItems { worker, experiment, items, .. } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    assert!(worker.specs.contains(&experiment), "the specification comes first");
                    self.n_items_sent += items.len();
                    worker.items.extend(items.into_iter().map(|item| (experiment, item)));
                }
                Command::SendEnd { worker, experiment } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    worker.specs.remove(&experiment);
                    worker.items.retain(|(of, _)| *of != experiment);
                }
                Command::Disconnect { worker, .. } => {
                    self.workers.remove(&worker);
                }
                Command::FinishGeneration { experiment, judged } => {
                    self.judged.push((experiment, judged));
                }
                Command::SendDrop { worker, items } => {
                    let worker = self.workers.get_mut(&worker).unwrap();
                    worker.items.retain(|(_, item)| !items.contains(&item.id));
                }
                Command::PauseExperiment { experiment, reason } => {
                    self.paused.push((experiment, reason));
                }
                Command::FailExperiment { experiment, reason } => {
                    self.failed.push((experiment, reason));
                }
            }
        }
        self.engine.sanity_check();
        for (id, worker) in &self.workers {
            let n_slots = self.engine.workers[id].n_slots();
            assert!(worker.items.len() <= ITEMS_PER_SLOT_MAX * n_slots, "credits are respected");
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

    pub(super) fn assert_judged(&self, n_individuals: usize, n_trials: u32) {
        let (_, judged) = &self.judged[0];
        let expected: Vec<Vec<f64>> = genotypes(n_individuals)
            .iter()
            .map(|genotype| (0..n_trials).map(|trial| fitness(genotype, trial)).collect())
            .collect();
        assert_eq!(judged.trial_fitness, expected);
        assert_eq!(self.judged.len(), 1, "a generation is judged once");
    }
}

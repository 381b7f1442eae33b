//! Workers come, go, and change.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    num::NonZeroU64,
    time::Duration,
};

use engine::{Assignment, Introduction, ItemResult, NamePattern};
use model::ids::{AssignmentId, WorkerId};
use sim_core::Output;

use super::{Conduct, Happening, SimulatedFleet, Work, Worker};

impl<W: Work> SimulatedFleet<W> {
    /// A new worker connects.
    pub fn join(&mut self, n_slots: usize, speed: f64) -> WorkerId {
        self.join_with(n_slots, speed, Conduct::Honest)
    }

    /// A new worker connects.
    pub fn join_with(&mut self, n_slots: usize, speed: f64, conduct: Conduct) -> WorkerId {
        let introduction = self.introduction(n_slots);
        self.connect(introduction, speed, conduct, false)
    }

    /// A worker connects that computes on [`Self::step`].
    pub fn join_by_hand(&mut self, n_slots: usize) -> WorkerId {
        let introduction = self.introduction(n_slots);
        self.connect(introduction, 1.0, Conduct::Honest, true)
    }

    /// A worker connects that takes only experiments with a matching name.
    pub fn join_for(&mut self, experiments: &str, speed: f64) -> WorkerId {
        let experiments = NamePattern::new(experiments);
        let introduction = Introduction { experiments, ..self.introduction(1) };
        self.connect(introduction, speed, Conduct::Honest, false)
    }

    fn introduction(&mut self, n_slots: usize) -> Introduction {
        self.n_processes += 1;
        Introduction {
            name: format!("worker-{}", self.n_processes).into(),
            version: "simulated".to_owned(),
            n_slots,
            experiments: NamePattern::default(),
            process: NonZeroU64::new(self.n_processes),
        }
    }

    /// A worker connects; by hand, it computes on [`Self::step`].
    pub fn connect(
        &mut self,
        introduction: Introduction,
        speed: f64,
        conduct: Conduct,
        is_by_hand: bool,
    ) -> WorkerId {
        let id = self.engine.on_worker_joined(self.instant(), introduction.clone());
        let worker = Worker {
            introduction,
            speed,
            queue: VecDeque::new(),
            last_assignment: AssignmentId(0),
            distributions: BTreeMap::new(),
            running: BTreeMap::new(),
            dropped: BTreeSet::new(),
            stalled_until: Duration::ZERO,
            postponed: Vec::new(),
            is_silent: false,
            is_by_hand,
            conduct,
        };
        self.workers.insert(id, worker);
        self.carry_out();
        id
    }

    /// A worker's stream breaks, and it does not come back.
    pub fn kill(&mut self, id: WorkerId) {
        self.forget(id);
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
    }

    /// A worker's stream breaks, and the worker reconnects at once.
    pub fn flap(&mut self, id: WorkerId) -> Option<WorkerId> {
        let Worker { introduction, speed, conduct, is_by_hand, .. } = self.workers.remove(&id)?;
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
        Some(self.connect(introduction, speed, conduct, is_by_hand))
    }

    /// A worker is killed, and started again at once under the same name.
    pub fn restart(&mut self, id: WorkerId) -> Option<WorkerId> {
        self.n_processes += 1;
        let process = NonZeroU64::new(self.n_processes);
        let Worker { introduction, speed, conduct, is_by_hand, .. } = self.workers.remove(&id)?;
        self.engine.on_worker_left(self.instant(), id);
        self.carry_out();
        Some(self.connect(Introduction { process, ..introduction }, speed, conduct, is_by_hand))
    }

    /// The open assignments of a worker that joined by hand.
    pub fn assigned(&self, id: WorkerId) -> Vec<Assignment> {
        let queue = self.workers.get(&id).map(|worker| &worker.queue);
        queue.into_iter().flatten().map(|queued| queued.assignment.clone()).collect()
    }

    /// Computes the oldest item of a worker that joined by hand; returns whether it had one.
    pub fn step(&mut self, id: WorkerId) -> bool {
        let worker = self.workers.get_mut(&id);
        let Some(queued) = worker.and_then(|worker| worker.queue.pop_front()) else {
            return false;
        };
        let outcome = self.work.compute(&queued.order());
        self.answer_with(id, queued.assignment.id, queued.output, outcome);
        true
    }

    /// A worker that joined by hand answers an assignment.
    pub fn answer(
        &mut self,
        id: WorkerId,
        assignment: AssignmentId,
        outcome: Result<Vec<f64>, String>,
    ) {
        self.answer_with(id, assignment, Output::Fitness, outcome);
    }

    /// A worker that joined by hand answers an assignment with numbers of either kind.
    pub fn answer_with(
        &mut self,
        id: WorkerId,
        assignment: AssignmentId,
        output: Output,
        outcome: Result<Vec<f64>, String>,
    ) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.queue.retain(|held| held.assignment.id != assignment);
        }
        let compute_time = self.model.trial;
        let result = ItemResult { id: assignment, output, outcome, compute_time };
        self.engine.on_results(self.instant(), id, vec![result]);
        self.carry_out();
    }

    /// Lets all workers that joined by hand compute until nothing is left.
    pub fn run_by_hand(&mut self) {
        let ids = self.worker_ids();
        while ids.iter().filter(|&&id| self.step(id)).count() > 0 {}
    }

    /// A worker computes nothing for a while, but sends heartbeats.
    pub fn stall(&mut self, id: WorkerId, time: Duration) {
        let until = self.now + time;
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.stalled_until = until;
            self.schedule(time, Happening::Awake(id));
        }
    }

    /// A worker falls silent.
    pub fn silence(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.is_silent = true;
        }
    }

    /// A worker computes and says nothing until [`Self::wake`], like a stopped process.
    pub fn hang(&mut self, id: WorkerId) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.stalled_until = Duration::MAX;
            worker.is_silent = true;
        }
    }

    /// A worker that hangs goes on.
    pub fn wake(&mut self, id: WorkerId) {
        let Some(worker) = self.workers.get_mut(&id) else { return };
        worker.stalled_until = self.now;
        worker.is_silent = false;
        self.schedule(Duration::ZERO, Happening::Awake(id));
    }

    /// A worker treats its next items like this.
    pub fn set_conduct(&mut self, id: WorkerId, conduct: Conduct) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.conduct = conduct;
        }
    }

    /// A worker computes its next items with this speed.
    pub fn set_speed(&mut self, id: WorkerId, speed: f64) {
        if let Some(worker) = self.workers.get_mut(&id) {
            worker.speed = speed;
        }
    }

    /// A worker wants no more items.
    pub fn drain(&mut self, id: WorkerId) {
        self.engine.on_draining(self.instant(), id);
        self.carry_out();
    }
}

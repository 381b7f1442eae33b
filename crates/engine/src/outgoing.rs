//! Collects messages to workers while the engine assigns items.

use std::{collections::BTreeMap, mem, sync::Arc};

use model::ids::{AssignmentId, JobId, WorkerId};

use super::{Assignment, Assignments, Batch, Command, Engine, ToWorker};

/// Bytes of a distribution that fit into a message with room to spare.
const DISTRIBUTION_LEN_MAX: usize = 16 << 20;

/// The messages so far.
#[derive(Debug, Default)]
pub struct Outgoing {
    recalled: BTreeMap<WorkerId, Vec<AssignmentId>>,
    /// In the order of assignment, so that a worker first computes the items that are oldest in
    /// [`InFlight`]; a loss is blamed on these.
    ///
    /// [`InFlight`]: super::in_flight::InFlight
    assignments: BTreeMap<WorkerId, Vec<Assignments>>,
}

impl Outgoing {
    /// Whether there is nothing to send.
    pub fn is_empty(&self) -> bool {
        self.recalled.is_empty() && self.assignments.is_empty()
    }

    /// A worker drops an assignment.
    pub fn recall(&mut self, worker: WorkerId, assignment: AssignmentId) {
        self.recalled.entry(worker).or_default().push(assignment);
    }

    /// A worker computes an item of a job's batch.
    pub fn assign(&mut self, worker: WorkerId, job: JobId, batch: &Batch, item: Assignment) {
        let messages = self.assignments.entry(worker).or_default();
        match messages.last_mut() {
            Some(last) if last.job == job => last.items.push(item),
            _ => {
                let Batch { trial_set, output, .. } = *batch;
                messages.push(Assignments { job, trial_set, output, items: vec![item] });
            }
        }
    }
}

impl Engine {
    /// Turns the collected messages into commands.
    pub(super) fn send(&mut self) {
        let Outgoing { recalled, assignments } = mem::take(&mut self.outgoing);
        for (worker, assignments) in recalled {
            if self.workers.contains_key(&worker) {
                self.tell(worker, ToWorker::Drop(assignments));
            }
        }
        let messages = assignments.into_iter().flat_map(|(worker, messages)| {
            messages.into_iter().map(move |message| (worker, message))
        });
        for (worker, mut message) in messages {
            let job = message.job;
            let known = self.workers.get_mut(&worker).map(|worker| &mut worker.known_jobs);
            if let Some(known) = known.filter(|known| !known.contains_key(&job)) {
                known.insert(job, None);
                let spec = Arc::clone(&self.jobs[&job].spec);
                self.tell(worker, ToWorker::Spec(job, spec));
            }
            self.draw_or_receive(worker, job, &mut message.items);
            self.tell(worker, ToWorker::Assignments(message));
        }
    }

    /// Has the caller send a worker a message.
    pub(super) fn tell(&mut self, worker: WorkerId, message: ToWorker) {
        self.commands.push_back(Command::Send(worker, message));
    }

    /// Decides whether a worker draws the genotypes of its assignments or receives them. It draws
    /// them if it has the distribution already, or if the distribution is shorter than the
    /// genotypes that it will probably get of the batch.
    fn draw_or_receive(&mut self, id: WorkerId, job: JobId, assignments: &mut [Assignment]) {
        let drawn: Vec<&mut Assignment> =
            assignments.iter_mut().filter(|assignment| assignment.is_drawn).collect();
        let [first, ..] = &drawn[..] else { return };
        let Some(batch) = self.jobs[&job].batch.as_ref() else { return };
        let Some(distribution) = &batch.request.distribution else { return };
        let Some(worker) = self.workers.get_mut(&id) else { return };
        let trial_set = Some(batch.request.trial_set);
        if worker.known_jobs.get(&job) == Some(&trial_set) {
            return;
        }
        let share = worker.n_slots() as f64 / self.load_index.n_usable_slots.max(1) as f64;
        let n_expected = drawn.len() as f64 + batch.queue.len() as f64 * share.min(1.0);
        let is_shorter = distribution.len() as f64
            <= (n_expected * size_of_val(&first.genotype[..]) as f64)
                .min(DISTRIBUTION_LEN_MAX as f64);
        if is_shorter {
            worker.known_jobs.insert(job, trial_set);
            let distribution = Arc::clone(distribution);
            self.tell(id, ToWorker::Distribution(job, distribution));
        } else {
            drawn.into_iter().for_each(|assignment| assignment.is_drawn = false);
        }
    }
}

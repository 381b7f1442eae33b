//! The invariants of an engine between two events.

use std::collections::BTreeMap;

use model::ids::JobId;

use super::{
    Engine, availability::Availability, job::JobWork, load_index::WorkerLoadIndex, stats::Counters,
    worker::Worker,
};

impl Engine {
    /// Panics if the state contradicts itself. For tests: it is slow, because it checks
    /// everything.
    pub fn sanity_check(&self) {
        let mut load_index = WorkerLoadIndex::default();
        let mut in_flight: BTreeMap<JobId, BTreeMap<_, _>> = BTreeMap::new();
        for (&id, worker) in &self.workers {
            load_index.add(id, worker);
            let n_trials: usize =
                worker.in_flight.values().map(|assigned| assigned.item.trials.len()).sum();
            assert_eq!(n_trials, worker.in_flight.n_trials());
            for (&assignment_id, assignment) in worker.in_flight.iter() {
                assert!(worker.known_jobs.contains_key(&assignment.job));
                let entry = (id, assignment.item.clone(), assignment.is_audit());
                in_flight.entry(assignment.job).or_default().insert(assignment_id, entry);
            }
            assert!(worker.recalled.len() <= 2 * worker.n_slots());
            let is_quarantined = matches!(worker.availability(), Availability::Quarantined(_));
            assert!(!is_quarantined || worker.in_flight.is_empty());
        }
        assert_eq!(load_index.available, self.load_index.available);
        assert_eq!(load_index.backlogged, self.load_index.backlogged);
        assert_eq!(load_index.n_idle_slots, self.load_index.n_idle_slots);
        assert_eq!(load_index.n_usable_slots, self.load_index.n_usable_slots);
        assert_eq!(load_index.usable_speed, self.load_index.usable_speed);
        for (&id, work) in &self.jobs {
            let in_flight = in_flight.remove(&id).unwrap_or_default();
            assert!(
                !work.is_paused || in_flight.is_empty(),
                "no worker has an item of a paused job"
            );
            assert_eq!(self.ready_queue.has(id, work), work.is_ready());
            match &work.batch {
                Some(batch) => batch.sanity_check(&in_flight),
                None => assert!(in_flight.is_empty()),
            }
        }
        assert!(in_flight.is_empty(), "no worker has an item of an ended job");
        let n_ready = self.jobs.values().filter(|work| work.is_ready()).count();
        assert_eq!(self.ready_queue.len(), n_ready);
        let has_queued = |work: &&JobWork| {
            work.is_ready() && work.batch.as_ref().is_some_and(|batch| !batch.queue.is_empty())
        };
        let is_neglected = |work: &JobWork| self.idle_taker(work, |_| true).is_some();
        assert!(
            !self.jobs.values().filter(has_queued).any(is_neglected),
            "no work waits while a slot is idle whose worker takes it"
        );
        assert!(self.outgoing.is_empty(), "everything is sent");
        let n_slots: usize = self.workers.values().map(Worker::n_slots).sum();
        assert_eq!(n_slots, self.fleet_time.n_slots());
        let Counters { n_workers_joined, n_workers_left, n_workers_lost, .. } = self.counters;
        let n_gone = n_workers_left + n_workers_lost;
        assert_eq!(n_workers_joined - n_gone, self.workers.len() as u64);
    }
}

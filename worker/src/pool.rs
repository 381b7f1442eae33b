//! The computing threads: each slot computes one assignment at a time, apart from the threads of
//! the network.

use std::{
    collections::VecDeque,
    fmt, io, mem,
    sync::{
        Arc, Condvar, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
    time::Instant,
};

use model::limits::ITEMS_PER_SLOT_MAX;
use sim_core::panic_to_failure;
use tokio::sync::mpsc;
use tracing::warn;

use crate::{
    assignment::{Assignment, ItemResult},
    stats::{Made, Stats},
};

/// Computes the numbers of an assignment, or says why it cannot. It regularly calls its second
/// argument to learn whether to continue, and returns `None` if not.
pub(crate) type Evaluator =
    Arc<dyn Fn(&Assignment, &dyn Fn() -> bool) -> Result<Option<Vec<f64>>, String> + Send + Sync>;

/// An assignment on its way through the pool.
pub(crate) struct Queued {
    pub(crate) assignment: Assignment,
    pub(crate) evaluator: Evaluator,
    pub(crate) reply: Reply,
}

/// The channel for results. The channel ends once all of its assignments are done or dropped;
/// results without a receiver are dropped.
pub(crate) type Reply = mpsc::Sender<ItemResult>;

/// A fixed number of threads that share a bounded queue. Dropping the pool drops the queue; each
/// thread ends after its assignment in progress.
#[derive(Debug)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    capacity: usize,
    n_slots: usize,
}

#[derive(Debug)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    stats: Arc<Stats>,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<Queued>,
    /// The assignments in progress.
    running: Vec<Arc<Running>>,
    /// Number of slots that wait for an assignment.
    n_idle: usize,
    closed: bool,
}

/// An assignment in a slot.
struct Running {
    assignment: Assignment,
    /// Whether its result is no longer needed.
    cancelled: AtomicBool,
}

impl fmt::Debug for Queue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ids: Vec<u64> = self.waiting.iter().map(|queued| queued.assignment.id).collect();
        f.debug_struct("Queue").field("assignments", &ids).field("closed", &self.closed).finish()
    }
}

impl Pool {
    /// Starts `slots` threads, or as many as the system gives, but at least one. The queue holds
    /// as many assignments as the coordinator may send ahead. `stats`: counts assignments.
    pub(crate) fn start(slots: usize, stats: Arc<Stats>) -> io::Result<Self> {
        let (queue, changed) = (Mutex::default(), Condvar::new());
        let shared = Arc::new(Shared { queue, changed, stats });
        // Built first, so that started threads end if a later one cannot start.
        let mut pool = Self { shared, capacity: 0, n_slots: 0 };
        for slot in 0..slots {
            let shared = Arc::clone(&pool.shared);
            let thread = thread::Builder::new().name(format!("slot-{slot}"));
            match thread.spawn(move || shared.work()) {
                Ok(_) => pool.n_slots += 1,
                Err(error) if slot == 0 => return Err(error),
                Err(error) => {
                    warn!("{slot} of {slots} slots: the system gives no more threads ({error})");
                    break;
                }
            }
        }
        pool.capacity = ITEMS_PER_SLOT_MAX * pool.n_slots;
        Ok(pool)
    }

    /// Number of assignments that are computed at the same time.
    pub(crate) fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// Number of assignments that the queue holds.
    pub(crate) fn capacity(&self) -> usize {
        self.capacity
    }

    /// Number of assignments that wait for a slot.
    pub(crate) fn n_queued(&self) -> usize {
        self.shared.lock().waiting.len()
    }

    /// Queues assignments, all at once to wake idle slots only once; returns those for which
    /// there is no room.
    pub(crate) fn submit(&self, queued: Vec<Queued>) -> Vec<Queued> {
        let mut queue = self.shared.lock();
        let n_waiting = queue.waiting.len();
        let mut queued = queued.into_iter();
        queue.waiting.extend(queued.by_ref().take(self.capacity.saturating_sub(n_waiting)));
        for _ in (n_waiting..queue.waiting.len()).take(queue.n_idle) {
            self.shared.changed.notify_one();
        }
        self.shared.report(&queue);
        queued.collect()
    }

    /// Drops all waiting assignments, and returns their number. Assignments in progress continue.
    pub(crate) fn drop_queued(&self) -> usize {
        let mut queue = self.shared.lock();
        let dropped = mem::take(&mut queue.waiting);
        self.shared.report(&queue);
        dropped.len()
    }

    /// Drops the assignments that match, waiting or in progress, and returns their number. They
    /// have no result.
    pub(crate) fn cancel(&self, matches: impl Fn(&Assignment) -> bool) -> usize {
        let mut queue = self.shared.lock();
        let n_before = queue.waiting.len();
        queue.waiting.retain(|queued| !matches(&queued.assignment));
        self.shared.report(&queue);
        let n_dropped = n_before - queue.waiting.len();
        let running = queue.running.iter().filter(|running| matches(&running.assignment));
        n_dropped + running.inspect(|running| running.cancelled.store(true, Relaxed)).count()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        let mut queue = self.shared.lock();
        queue.closed = true;
        queue.waiting.clear();
        self.shared.report(&queue);
        self.shared.changed.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().expect("nothing panics while it holds the queue")
    }

    /// Updates the statistics after a change of the queue.
    fn report(&self, queue: &Queue) {
        self.stats.on_queue(queue.waiting.len(), queue.running.len());
    }

    /// The loop of a slot's thread.
    fn work(&self) {
        while let Some((running, evaluator, reply)) = self.next() {
            let result = compute(&running, &evaluator, &self.stats);
            let mut queue = self.lock();
            queue.running.retain(|other| !Arc::ptr_eq(other, &running));
            self.report(&queue);
            drop(queue);
            if let Some(result) = result {
                // An error means that the stream of this assignment has ended, so the result has
                // no receiver.
                let _ = reply.blocking_send(result);
            }
        }
    }

    /// Waits for an assignment; `None` once the pool is closed.
    fn next(&self) -> Option<(Arc<Running>, Evaluator, Reply)> {
        let mut queue = self.lock();
        while queue.waiting.is_empty() && !queue.closed {
            queue.n_idle += 1;
            queue = self.changed.wait(queue).expect("nothing panics while it holds the queue");
            queue.n_idle -= 1;
        }
        let Queued { assignment, evaluator, reply } = queue.waiting.pop_front()?;
        let running = Arc::new(Running { assignment, cancelled: AtomicBool::new(false) });
        queue.running.push(Arc::clone(&running));
        self.report(&queue);
        Some((running, evaluator, reply))
    }
}

/// Computes one assignment; `None` if it is cancelled meanwhile. A panic fails the assignment, not
/// the worker.
#[expect(
    clippy::disallowed_methods,
    reason = "reports how long an assignment took; decides nothing"
)]
fn compute(
    Running { assignment, cancelled }: &Running,
    evaluator: &Evaluator,
    stats: &Stats,
) -> Option<ItemResult> {
    let started = Instant::now();
    let keep_going = || !cancelled.load(Relaxed);
    let outcome = panic_to_failure(|| evaluator(assignment, &keep_going));
    let duration = started.elapsed();
    let made = match &outcome {
        Ok(Some(_)) => Made::Fitness { n_episodes: assignment.trials.len() as u64 },
        Ok(None) => Made::Nothing,
        Err(_) => Made::Failure,
    };
    stats.on_item(made, duration);
    let &Assignment { id: assignment_id, output, .. } = assignment;
    Some(ItemResult { assignment_id, output, outcome: outcome.transpose()?, duration })
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc as std_mpsc, time::Duration};

    use sim_core::{Output, TrialSet};

    use super::*;
    use model::ids::{ExperimentId, JobId};

    use crate::assignment::Genotype;

    fn assignment(id: u64) -> Assignment {
        Assignment {
            id,
            job: JobId::Experiment(ExperimentId(id % 2)),
            trial_set: TrialSet::Generation(0),
            output: Output::Fitness,
            trials: 0..1,
            genotype: Genotype::Sent(vec![id as f64]),
        }
    }

    fn queued(id: u64, evaluator: &Evaluator, reply: &Reply) -> Queued {
        Queued {
            assignment: assignment(id),
            evaluator: Arc::clone(evaluator),
            reply: reply.clone(),
        }
    }

    fn submit(pool: &Pool, queued: Queued) {
        assert!(pool.submit(vec![queued]).is_empty(), "the queue has room");
    }

    /// All results of a channel until its end, by item.
    fn collect(mut results: mpsc::Receiver<ItemResult>) -> Vec<(u64, Result<Vec<f64>, String>)> {
        let mut all = Vec::new();
        while let Some(result) = results.blocking_recv() {
            all.push((result.assignment_id, result.outcome));
        }
        all.sort_by_key(|(id, _)| *id);
        all
    }

    /// An evaluator that reports when it starts an item, and waits for permission to finish it.
    fn gated() -> (Evaluator, std_mpsc::Receiver<u64>, std_mpsc::Sender<()>) {
        let (started, starts) = std_mpsc::channel();
        let (permit, permits) = std_mpsc::channel();
        let permits = Mutex::new(permits);
        let evaluator: Evaluator = Arc::new(move |assignment, keep_going| {
            started.send(assignment.id).map_err(|error| error.to_string())?;
            permits.lock().unwrap().recv().map_err(|error| error.to_string())?;
            let genes = assignment.genotype.genes()?;
            Ok(keep_going().then(|| genes.into_owned()))
        });
        (evaluator, starts, permit)
    }

    #[test]
    fn every_item_gets_its_own_outcome() {
        let pool = Pool::start(4, Arc::default()).unwrap();
        let (reply, results) = mpsc::channel(8);
        let evaluator: Evaluator =
            Arc::new(|assignment, _| Ok(Some(assignment.genotype.genes()?.into_owned())));
        for id in 0..8 {
            submit(&pool, queued(id, &evaluator, &reply));
        }
        drop(reply);
        let expected: Vec<_> = (0..8).map(|id| (id, Ok(vec![id as f64]))).collect();
        assert_eq!(collect(results), expected);
    }

    #[test]
    fn a_panic_fails_its_item_and_spares_the_slot() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, results) = mpsc::channel(4);
        let evaluator: Evaluator = Arc::new(|assignment, _| match assignment.id {
            0 => panic!("no such robot"),
            1 => panic!("robot {}", assignment.id),
            _ => Ok(Some(vec![])),
        });
        let all = (0..3).map(|id| queued(id, &evaluator, &reply)).collect();
        assert!(pool.submit(all).is_empty());
        drop(reply);
        let failed = |what: &str| Err(format!("panicked: {what}"));
        let expected = [(0, failed("no such robot")), (1, failed("robot 1")), (2, Ok(vec![]))];
        assert_eq!(collect(results), expected);
    }

    #[test]
    fn dropping_the_queue_lets_items_in_progress_finish() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, results) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, queued(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, queued(1, &evaluator, &reply));
        submit(&pool, queued(2, &evaluator, &reply));
        assert_eq!(pool.drop_queued(), 2);
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(results), [(0, Ok(vec![0.0]))]);
    }

    #[test]
    fn cancelling_stops_running_items_and_drops_waiting_ones() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, results) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, queued(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        for id in 1..=3 {
            submit(&pool, queued(id, &evaluator, &reply));
        }
        assert_eq!(
            pool.cancel(|assignment| assignment.job == JobId::Experiment(ExperimentId(0))),
            2,
            "one runs, one waits"
        );
        for _ in 0..3 {
            permit.send(()).unwrap();
        }
        drop(reply);
        assert_eq!(collect(results), [(1, Ok(vec![1.0])), (3, Ok(vec![3.0]))]);
    }

    #[test]
    fn outcomes_of_items_are_counted() {
        let stats = Arc::new(Stats::default());
        let pool = Pool::start(1, Arc::clone(&stats)).unwrap();
        let (reply, results) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, queued(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, queued(1, &evaluator, &reply));
        submit(&pool, queued(2, &evaluator, &reply));
        let snapshot = stats.snapshot();
        assert_eq!((snapshot.n_slots_busy, snapshot.n_items_queued), (1, 2));
        pool.cancel(|assignment| assignment.job == JobId::Experiment(ExperimentId(0)));
        let failing: Evaluator = Arc::new(|_, _| Err("no such robot".into()));
        submit(&pool, queued(3, &failing, &reply));
        permit.send(()).unwrap();
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(results).len(), 2);
        let snapshot = stats.snapshot();
        assert_eq!(snapshot.n_items_computed, 1);
        assert_eq!(snapshot.n_items_failed, 1);
        assert_eq!(snapshot.n_items_dropped, 1, "one of the two had not begun");
        assert_eq!(snapshot.n_episodes, 1);
        assert_eq!((snapshot.n_slots_busy, snapshot.n_items_queued), (0, 0));
        assert!(snapshot.busy > Duration::ZERO);
    }

    #[test]
    fn a_full_queue_gives_the_assignment_back() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, _results) = mpsc::channel(4);
        let (evaluator, starts, _permit) = gated();
        submit(&pool, queued(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        for id in 1..=pool.capacity() as u64 {
            submit(&pool, queued(id, &evaluator, &reply));
        }
        let back = pool.submit(vec![queued(99, &evaluator, &reply)]);
        let back = back.into_iter().map(|queued| queued.assignment).collect::<Vec<_>>();
        assert_eq!(back, [assignment(99)]);
    }

    #[test]
    fn a_dropped_pool_finishes_only_items_in_progress() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, results) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, queued(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, queued(1, &evaluator, &reply));
        drop(pool);
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(results), [(0, Ok(vec![0.0]))]);
    }

    #[test]
    fn results_that_nobody_waits_for_do_not_block_a_slot() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let evaluator: Evaluator =
            Arc::new(|assignment, _| Ok(Some(assignment.genotype.genes()?.into_owned())));
        let (gone, receiver) = mpsc::channel(1);
        drop(receiver);
        submit(&pool, queued(0, &evaluator, &gone));
        submit(&pool, queued(1, &evaluator, &gone));
        let (reply, results) = mpsc::channel(1);
        while !pool.submit(vec![queued(2, &evaluator, &reply)]).is_empty() {
            thread::yield_now();
        }
        drop(reply);
        assert_eq!(collect(results), [(2, Ok(vec![2.0]))]);
    }
}

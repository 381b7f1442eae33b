//! The threads that compute: one item per slot at a time, apart from the threads
//! that talk to the network.

use std::{
    any::Any,
    collections::VecDeque,
    fmt, io, mem,
    ops::Range,
    panic::{self, AssertUnwindSafe},
    sync::{
        Arc, Condvar, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    thread,
    time::{Duration, Instant},
};

use swarm_proto::ITEMS_PER_SLOT_MAX;
use tokio::sync::mpsc;

use crate::activity::{Activity, Made};

/// One genotype and the trials to run it on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) id: u64,
    pub(crate) experiment_id: u64,
    pub(crate) generation: u64,
    pub(crate) trials: Range<u32>,
    pub(crate) genotype: Vec<f64>,
}

/// Computes the fitness of an item, one per trial, or measures its trials, or says
/// why it cannot. Asks now and then whether to go on; none if it was stopped.
pub(crate) type Evaluator =
    Arc<dyn Fn(&Item, &dyn Fn() -> bool) -> Result<Option<Vec<f64>>, String> + Send + Sync>;

/// What became of an item.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) item_id: u64,
    /// Whose trials they are.
    pub(crate) generation: u64,
    /// One number per trial, or what is measured of each.
    pub(crate) fitness: Result<Vec<f64>, String>,
    pub(crate) duration: Duration,
}

/// An item on its way through the pool.
pub(crate) struct Task {
    pub(crate) item: Item,
    pub(crate) evaluator: Evaluator,
    /// Where the outcome goes; if nobody listens there any more, nowhere. Once
    /// all tasks of a channel are done or dropped, the channel ends.
    pub(crate) reply: mpsc::Sender<Outcome>,
}

/// A fixed number of threads that share a bounded queue. Dropping the pool drops
/// the queue; the threads end once they have finished what they are computing.
#[derive(Debug)]
pub(crate) struct Pool {
    shared: Arc<Shared>,
    capacity: usize,
}

#[derive(Debug)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
    activity: Arc<Activity>,
}

#[derive(Default)]
struct Queue {
    tasks: VecDeque<Task>,
    /// What the slots are computing.
    running: Vec<Arc<Running>>,
    closed: bool,
}

/// An item in a slot.
struct Running {
    item: Item,
    /// Nobody wants its outcome any more.
    cancelled: AtomicBool,
}

impl fmt::Debug for Queue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let items: Vec<u64> = self.tasks.iter().map(|task| task.item.id).collect();
        f.debug_struct("Queue").field("items", &items).field("closed", &self.closed).finish()
    }
}

impl Pool {
    /// Starts `slots` threads; the queue holds as many tasks as the coordinator may
    /// send ahead. `activity`: where they are counted.
    pub(crate) fn start(slots: usize, activity: Arc<Activity>) -> io::Result<Self> {
        let (queue, changed) = (Mutex::default(), Condvar::new());
        let shared = Arc::new(Shared { queue, changed, activity });
        // Built first, so that the threads that did start end if one does not.
        let pool = Self { shared, capacity: ITEMS_PER_SLOT_MAX * slots };
        for slot in 0..slots {
            let shared = Arc::clone(&pool.shared);
            thread::Builder::new().name(format!("slot-{slot}")).spawn(move || shared.work())?;
        }
        Ok(pool)
    }

    /// Number of tasks that the queue holds.
    pub(crate) fn capacity(&self) -> usize {
        self.capacity
    }

    /// Queues a task, or gives it back if the queue is full.
    pub(crate) fn submit(&self, task: Task) -> Result<(), Task> {
        let mut queue = self.shared.lock();
        if queue.tasks.len() >= self.capacity {
            return Err(task);
        }
        queue.tasks.push_back(task);
        self.shared.report(&queue);
        self.shared.changed.notify_one();
        Ok(())
    }

    /// Drops all tasks that wait, and returns their number. What is being computed
    /// goes on.
    pub(crate) fn drop_queued(&self) -> usize {
        let mut queue = self.shared.lock();
        let dropped = mem::take(&mut queue.tasks);
        self.shared.report(&queue);
        dropped.len()
    }

    /// Drops the tasks that match, whether they wait or are being computed, and
    /// returns their number. They have no outcome.
    pub(crate) fn cancel(&self, matches: impl Fn(&Item) -> bool) -> usize {
        let mut queue = self.shared.lock();
        let n_before = queue.tasks.len();
        queue.tasks.retain(|task| !matches(&task.item));
        self.shared.report(&queue);
        let n_dropped = n_before - queue.tasks.len();
        let running = queue.running.iter().filter(|running| matches(&running.item));
        n_dropped + running.inspect(|running| running.cancelled.store(true, Relaxed)).count()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        let mut queue = self.shared.lock();
        queue.closed = true;
        queue.tasks.clear();
        self.shared.report(&queue);
        self.shared.changed.notify_all();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().expect("nothing panics while it holds the queue")
    }

    /// The queue has changed.
    fn report(&self, queue: &Queue) {
        self.activity.on_queue(queue.tasks.len(), queue.running.len());
    }

    /// A slot's life.
    fn work(&self) {
        while let Some((running, evaluator, reply)) = self.next_task() {
            let outcome = compute(&running, &evaluator, &self.activity);
            let mut queue = self.lock();
            queue.running.retain(|other| !Arc::ptr_eq(other, &running));
            self.report(&queue);
            drop(queue);
            if let Some(outcome) = outcome {
                // An error means that the stream of this item is gone, and with it
                // the use of the outcome.
                let _ = reply.blocking_send(outcome);
            }
        }
    }

    /// Waits for a task; none once the pool is closed.
    fn next_task(&self) -> Option<(Arc<Running>, Evaluator, mpsc::Sender<Outcome>)> {
        let mut queue = self
            .changed
            .wait_while(self.lock(), |queue| queue.tasks.is_empty() && !queue.closed)
            .expect("nothing panics while it holds the queue");
        let Task { item, evaluator, reply } = queue.tasks.pop_front()?;
        let running = Arc::new(Running { item, cancelled: AtomicBool::new(false) });
        queue.running.push(Arc::clone(&running));
        self.report(&queue);
        Some((running, evaluator, reply))
    }
}

/// Computes one item; no outcome if it is cancelled meanwhile. A panic is the
/// item's failure, not the worker's.
#[expect(clippy::disallowed_methods, reason = "reports how long an item took; decides nothing")]
fn compute(
    Running { item, cancelled }: &Running,
    evaluator: &Evaluator,
    activity: &Activity,
) -> Option<Outcome> {
    let started = Instant::now();
    let keep_going = || !cancelled.load(Relaxed);
    let fitness = panic::catch_unwind(AssertUnwindSafe(|| evaluator(item, &keep_going)))
        .unwrap_or_else(|payload| Err(format!("panicked: {}", panic_message(&*payload))));
    let duration = started.elapsed();
    let made = match &fitness {
        Ok(Some(_)) => Made::Fitness { n_episodes: item.trials.len() as u64 },
        Ok(None) => Made::Nothing,
        Err(_) => Made::Failure,
    };
    activity.on_item(made, duration);
    let &Item { id: item_id, generation, .. } = item;
    Some(Outcome { item_id, generation, fitness: fitness.transpose()?, duration })
}

fn panic_message(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc as std_mpsc;

    use super::*;

    fn item(id: u64) -> Item {
        Item { id, experiment_id: id % 2, generation: 0, trials: 0..1, genotype: vec![id as f64] }
    }

    fn task(id: u64, evaluator: &Evaluator, reply: &mpsc::Sender<Outcome>) -> Task {
        Task { item: item(id), evaluator: Arc::clone(evaluator), reply: reply.clone() }
    }

    fn submit(pool: &Pool, task: Task) {
        assert!(pool.submit(task).is_ok(), "the queue has room");
    }

    /// All outcomes of a channel that ends, by item.
    fn collect(mut outcomes: mpsc::Receiver<Outcome>) -> Vec<(u64, Result<Vec<f64>, String>)> {
        let mut all = Vec::new();
        while let Some(outcome) = outcomes.blocking_recv() {
            all.push((outcome.item_id, outcome.fitness));
        }
        all.sort_by_key(|(id, _)| *id);
        all
    }

    /// An evaluator that says when it starts an item and waits for permission to
    /// finish it.
    fn gated() -> (Evaluator, std_mpsc::Receiver<u64>, std_mpsc::Sender<()>) {
        let (started, starts) = std_mpsc::channel();
        let (permit, permits) = std_mpsc::channel();
        let permits = Mutex::new(permits);
        let evaluator: Evaluator = Arc::new(move |item, keep_going| {
            started.send(item.id).map_err(|error| error.to_string())?;
            permits.lock().unwrap().recv().map_err(|error| error.to_string())?;
            Ok(keep_going().then(|| item.genotype.clone()))
        });
        (evaluator, starts, permit)
    }

    #[test]
    fn every_item_gets_its_own_outcome() {
        let pool = Pool::start(4, Arc::default()).unwrap();
        let (reply, outcomes) = mpsc::channel(8);
        let evaluator: Evaluator = Arc::new(|item, _| Ok(Some(item.genotype.clone())));
        for id in 0..8 {
            submit(&pool, task(id, &evaluator, &reply));
        }
        drop(reply);
        let expected: Vec<_> = (0..8).map(|id| (id, Ok(vec![id as f64]))).collect();
        assert_eq!(collect(outcomes), expected);
    }

    #[test]
    fn a_panic_fails_its_item_and_spares_the_slot() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, outcomes) = mpsc::channel(4);
        let evaluator: Evaluator = Arc::new(|item, _| match item.id {
            0 => panic!("no such robot"),
            1 => panic!("robot {}", item.id),
            _ => Ok(Some(vec![])),
        });
        submit(&pool, task(0, &evaluator, &reply));
        submit(&pool, task(1, &evaluator, &reply));
        let mut received = outcomes;
        assert!(received.blocking_recv().is_some());
        submit(&pool, task(2, &evaluator, &reply));
        drop(reply);
        let rest = collect(received);
        assert_eq!(rest, [(1, Err("panicked: robot 1".into())), (2, Ok(vec![]))]);
    }

    #[test]
    fn dropping_what_is_queued_lets_what_is_running_finish() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, outcomes) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, task(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, task(1, &evaluator, &reply));
        submit(&pool, task(2, &evaluator, &reply));
        assert_eq!(pool.drop_queued(), 2);
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(outcomes), [(0, Ok(vec![0.0]))]);
    }

    #[test]
    fn cancelling_stops_what_is_running_and_drops_what_waits() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, outcomes) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, task(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        for id in 1..=3 {
            submit(&pool, task(id, &evaluator, &reply));
        }
        assert_eq!(pool.cancel(|item| item.experiment_id == 0), 2, "one runs, one waits");
        for _ in 0..3 {
            permit.send(()).unwrap();
        }
        drop(reply);
        assert_eq!(collect(outcomes), [(1, Ok(vec![1.0])), (3, Ok(vec![3.0]))]);
    }

    #[test]
    fn what_becomes_of_items_is_counted() {
        let activity = Arc::new(Activity::default());
        let pool = Pool::start(1, Arc::clone(&activity)).unwrap();
        let (reply, outcomes) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, task(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, task(1, &evaluator, &reply));
        submit(&pool, task(2, &evaluator, &reply));
        let figures = activity.figures();
        assert_eq!((figures.n_slots_busy, figures.n_items_queued), (1, 2));
        pool.cancel(|item| item.experiment_id == 0);
        let failing: Evaluator = Arc::new(|_, _| Err("no such robot".into()));
        submit(&pool, task(3, &failing, &reply));
        permit.send(()).unwrap();
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(outcomes).len(), 2);
        let figures = activity.figures();
        assert_eq!(figures.n_items_computed, 1);
        assert_eq!(figures.n_items_failed, 1);
        assert_eq!(figures.n_items_dropped, 1, "of two, one had not begun");
        assert_eq!(figures.n_episodes, 1);
        assert_eq!((figures.n_slots_busy, figures.n_items_queued), (0, 0));
        assert!(figures.busy > Duration::ZERO);
    }

    #[test]
    fn a_full_queue_gives_the_task_back() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, _outcomes) = mpsc::channel(4);
        let (evaluator, starts, _permit) = gated();
        submit(&pool, task(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        for id in 1..=pool.capacity() as u64 {
            submit(&pool, task(id, &evaluator, &reply));
        }
        assert_eq!(
            pool.submit(task(99, &evaluator, &reply)).map_err(|task| task.item),
            Err(item(99))
        );
    }

    #[test]
    fn a_dropped_pool_finishes_what_is_running_and_nothing_else() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let (reply, outcomes) = mpsc::channel(4);
        let (evaluator, starts, permit) = gated();
        submit(&pool, task(0, &evaluator, &reply));
        assert_eq!(starts.recv(), Ok(0));
        submit(&pool, task(1, &evaluator, &reply));
        drop(pool);
        permit.send(()).unwrap();
        drop(reply);
        assert_eq!(collect(outcomes), [(0, Ok(vec![0.0]))]);
    }

    #[test]
    fn outcomes_that_nobody_waits_for_do_not_block_a_slot() {
        let pool = Pool::start(1, Arc::default()).unwrap();
        let evaluator: Evaluator = Arc::new(|item, _| Ok(Some(item.genotype.clone())));
        let (gone, receiver) = mpsc::channel(1);
        drop(receiver);
        submit(&pool, task(0, &evaluator, &gone));
        submit(&pool, task(1, &evaluator, &gone));
        let (reply, outcomes) = mpsc::channel(1);
        while pool.submit(task(2, &evaluator, &reply)).is_err() {
            thread::yield_now();
        }
        drop(reply);
        assert_eq!(collect(outcomes), [(2, Ok(vec![2.0]))]);
    }
}

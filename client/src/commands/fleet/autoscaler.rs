//! The number of workers that a fleet needs, and the jobs to submit and to end.
//!
//! The rule and its numbers are those of Kubernetes' autoscaler in
//! `docs/deploy/kubernetes/autoscaler.yaml`: the same queue gives the same number of
//! workers. Time is an argument.

use std::{collections::VecDeque, time::Duration};

use tokio::time::Instant;

/// Open items for each worker.
pub const ITEMS_PER_WORKER: u64 = 16;
/// The fleet grows once the queue has been long for this time.
pub const UP_WINDOW: Duration = Duration::from_secs(30);
/// The fleet shrinks once the queue has been short for this time. The empty queue at the end of
/// a generation does not last so long.
pub const DOWN_WINDOW: Duration = Duration::from_secs(600);

/// Bounds of the number of workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    pub min: u32,
    /// At least `min`.
    pub max: u32,
}

/// Decides the number of workers.
#[derive(Debug)]
pub struct Autoscaler {
    bounds: Bounds,
    /// The numbers of workers that the queue alone required within [`DOWN_WINDOW`], with
    /// their times, oldest first.
    recent: VecDeque<(Instant, u32)>,
}

impl Autoscaler {
    pub fn new(bounds: Bounds) -> Self {
        Self { bounds, recent: VecDeque::new() }
    }

    /// The required number of workers; `n_workers`: the present number; `n_items`: items of
    /// running experiments that wait or are computed.
    pub fn wanted(&mut self, now: Instant, n_items: u64, n_workers: u32) -> u32 {
        let Bounds { min, max } = self.bounds;
        let by_queue = u32::try_from(n_items.div_ceil(ITEMS_PER_WORKER)).unwrap_or(u32::MAX);
        self.recent.push_back((now, by_queue.clamp(min, max)));
        while self.recent.front().is_some_and(|(at, _)| now - *at > DOWN_WINDOW) {
            self.recent.pop_front();
        }
        let recent =
            |window| self.recent.iter().filter(move |(at, _)| now - *at <= window).map(|(_, n)| *n);
        let up = recent(UP_WINDOW).min().unwrap_or(min);
        let down = recent(DOWN_WINDOW).max().unwrap_or(max);
        // The bounds take precedence over the queue.
        n_workers.max(up).min(down).clamp(min, max)
    }
}

/// A job of the batch system that runs a worker, or waits to run one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    pub id: String,
    /// Whether the job has a node; otherwise it waits for one.
    pub is_running: bool,
}

/// The jobs to submit and to end.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// Number of jobs to submit.
    pub n_submit: u32,
    /// Waiting jobs to withdraw from the queue.
    pub withdraw: Vec<String>,
    /// Running jobs whose workers should finish their items and end.
    pub finish: Vec<String>,
}

impl Plan {
    /// The plan that leads from these jobs, oldest first, to the required number. It ends
    /// waiting jobs before running ones, the newest first.
    pub fn new(jobs: &[Job], n_wanted: u32) -> Self {
        let n_wanted = n_wanted as usize;
        let n_submit = n_wanted.saturating_sub(jobs.len()) as u32;
        let newest = |is_running| jobs.iter().rev().filter(move |job| job.is_running == is_running);
        let surplus = newest(false).chain(newest(true)).take(jobs.len().saturating_sub(n_wanted));
        let (finish, withdraw): (Vec<&Job>, Vec<&Job>) = surplus.partition(|job| job.is_running);
        let ids = |jobs: Vec<&Job>| jobs.into_iter().map(|job| job.id.clone()).collect();
        Self { n_submit, withdraw: ids(withdraw), finish: ids(finish) }
    }

    /// Whether there is nothing to do.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// What was done of a plan.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Done {
    /// Numbers of the submitted jobs.
    pub submitted: Vec<String>,
    /// Numbers of the waiting jobs that were withdrawn.
    pub withdrawn: Vec<String>,
    /// Numbers of the jobs whose workers were told to finish.
    pub finishing: Vec<String>,
}

impl Done {
    /// Whether nothing was done.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const BOUNDS: Bounds = Bounds { min: 1, max: 40 };

    #[test]
    fn the_manifest_of_kubernetes_has_the_same_numbers() {
        let path = "/../docs/deploy/kubernetes/autoscaler.yaml";
        let path = format!("{}{path}", env!("CARGO_MANIFEST_DIR"));
        let manifest = std::fs::read_to_string(path).unwrap();
        let (_, up_and_down) = manifest.split_once("scaleUp:").unwrap();
        let (up, down) = up_and_down.split_once("scaleDown:").unwrap();
        let window = |part: &str, window: Duration| {
            part.contains(&format!("stabilizationWindowSeconds: {}", window.as_secs()))
        };
        assert!(manifest.contains(&format!("averageValue: \"{ITEMS_PER_WORKER}\"")));
        assert!(window(up, UP_WINDOW) && window(down, DOWN_WINDOW));
    }

    #[test]
    fn only_a_long_idleness_ends_workers() {
        let start = Instant::now();
        let at = |s| start + Duration::from_secs(s);
        let mut scaler = Autoscaler::new(Bounds { min: 0, max: 40 });
        assert_eq!(scaler.wanted(at(0), 160, 0), 10, "the first is answered at once");
        assert_eq!(scaler.wanted(at(15), 0, 10), 10);
        assert_eq!(scaler.wanted(at(30), 640, 10), 10, "not yet for long");
        assert_eq!(scaler.wanted(at(46), 640, 10), 40);
        assert_eq!(scaler.wanted(at(646), 0, 40), 40);
        assert_eq!(scaler.wanted(at(647), 0, 40), 0);
    }

    proptest! {
        #[test]
        fn the_bounds_hold_and_a_steady_queue_gets_enough_workers(
            queue in prop::collection::vec((0..2000_u64, 1..100_u64), 1..40),
            n_workers in 0..60_u32,
        ) {
            let mut scaler = Autoscaler::new(BOUNDS);
            let mut now = Instant::now();
            let mut n = n_workers;
            for (n_items, pause_s) in &queue {
                now += Duration::from_secs(*pause_s);
                n = scaler.wanted(now, *n_items, n);
                prop_assert!((BOUNDS.min..=BOUNDS.max).contains(&n));
            }
            let (steady, _) = queue[queue.len() - 1];
            for _ in 0..2 {
                now += DOWN_WINDOW + Duration::from_secs(1);
                n = scaler.wanted(now, steady, n);
            }
            prop_assert_eq!(u64::from(n), steady.div_ceil(ITEMS_PER_WORKER).clamp(1, 40));
        }

        #[test]
        fn a_plan_leads_to_the_wanted_number_and_ends_waiting_jobs_first(
            running in prop::collection::vec(any::<bool>(), 0..30),
            n_wanted in 0..30_u32,
        ) {
            let job = |(i, &is_running): (usize, &bool)| Job { id: i.to_string(), is_running };
            let jobs: Vec<Job> = running.iter().enumerate().map(job).collect();
            let plan = Plan::new(&jobs, n_wanted);
            let n_ended = plan.withdraw.len() + plan.finish.len();
            prop_assert_eq!(jobs.len() - n_ended + plan.n_submit as usize, n_wanted as usize);
            prop_assert!(n_ended == 0 || plan.n_submit == 0);
            let n_waiting = running.iter().filter(|is_running| !**is_running).count();
            prop_assert!(plan.finish.is_empty() || plan.withdraw.len() == n_waiting);
            let is_running = |id: &String| running[id.parse::<usize>().unwrap()];
            prop_assert!(plan.finish.iter().all(is_running));
            prop_assert!(!plan.withdraw.iter().any(is_running));
        }
    }
}

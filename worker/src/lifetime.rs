//! Ends a worker that has been idle for long, or whose time is up.
//!
//! The decision is a plain struct: the time and the worker's statistics are arguments.

use std::time::{Duration, Instant};

use crate::StatsSnapshot;

/// Time to deliver results and to close the connection.
const MARGIN: Duration = Duration::from_secs(5);
/// Time for the last items, in multiples of the longest item so far.
const N_LONGEST: u32 = 2;

/// Bounds on a worker's life; without any, the worker lives until it is told to stop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Lifetime {
    /// Time without an item after which the worker ends.
    pub idle_timeout: Option<Duration>,
    /// The worker ends within this time after its start.
    pub time_limit: Option<Duration>,
}

/// Why a worker ends by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expired {
    /// It has had no item for the idle timeout.
    Idle,
    /// Its time limit is near, so it has to finish its items.
    TimeIsNear,
    /// Its time limit is reached, with no time left to finish its items.
    TimeIsUp,
}

/// Watches a worker's life.
#[derive(Debug)]
pub struct Watchdog {
    lifetime: Lifetime,
    started: Instant,
    /// Time of the last look at which it had an item.
    idle_since: Instant,
    /// Number of ended items at the last look.
    n_done: u64,
}

impl Lifetime {
    /// Whether it has any bound.
    pub fn is_bounded(&self) -> bool {
        self.idle_timeout.is_some() || self.time_limit.is_some()
    }
}

impl Watchdog {
    /// Watches a worker that starts now.
    pub fn new(lifetime: Lifetime, now: Instant) -> Self {
        Self { lifetime, started: now, idle_since: now, n_done: 0 }
    }

    /// Longest time until the next look.
    pub fn interval(&self) -> Duration {
        let shortest = self.lifetime.idle_timeout.into_iter().chain(self.lifetime.time_limit).min();
        let interval = shortest.unwrap_or(Duration::MAX) / 8;
        interval.clamp(Duration::from_millis(10), Duration::from_secs(1))
    }

    /// Looks at the worker's statistics; returns why it should end, if it should.
    pub fn look(&mut self, now: Instant, stats: &StatsSnapshot) -> Option<Expired> {
        let n_done = stats.n_items_computed + stats.n_items_failed + stats.n_items_dropped;
        if stats.n_items_queued + stats.n_slots_busy > 0 || n_done != self.n_done {
            (self.idle_since, self.n_done) = (now, n_done);
        }
        if let Some(limit) = self.lifetime.time_limit {
            let age = now - self.started;
            // If the limit is short, half of it stays for work.
            let needed = (N_LONGEST * stats.longest_item + MARGIN).min(limit / 2);
            if age >= limit {
                return Some(Expired::TimeIsUp);
            } else if age + needed >= limit {
                return Some(Expired::TimeIsNear);
            }
        }
        let is_idle = |timeout| now - self.idle_since >= timeout;
        self.lifetime.idle_timeout.is_some_and(is_idle).then_some(Expired::Idle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn busy(n_slots_busy: usize, longest_item: Duration) -> StatsSnapshot {
        StatsSnapshot { n_slots_busy, longest_item, ..StatsSnapshot::default() }
    }

    fn watchdog(idle_s: Option<u32>, limit_s: Option<u32>) -> (Watchdog, Instant) {
        let lifetime = Lifetime {
            idle_timeout: idle_s.map(|s| s * SECOND),
            time_limit: limit_s.map(|s| s * SECOND),
        };
        #[expect(clippy::disallowed_methods, reason = "any moment will do")]
        let now = Instant::now();
        (Watchdog::new(lifetime, now), now)
    }

    #[test]
    fn a_worker_that_gets_no_item_for_the_whole_timeout_is_idle() {
        let (mut dog, start) = watchdog(Some(10), None);
        let none = StatsSnapshot::default();
        assert_eq!(dog.look(start + 9 * SECOND, &busy(1, SECOND)), None);
        assert_eq!(dog.look(start + 18 * SECOND, &none), None);
        assert_eq!(dog.look(start + 19 * SECOND, &none), Some(Expired::Idle));
        // An item that arrived and ended between two looks.
        let done = StatsSnapshot { n_items_computed: 1, ..none };
        assert_eq!(dog.look(start + 20 * SECOND, &done), None);
        assert_eq!(dog.look(start + 30 * SECOND, &done), Some(Expired::Idle));
    }

    #[test]
    fn long_items_get_time_to_finish() {
        let (mut dog, start) = watchdog(None, Some(3600));
        let long = busy(8, 300 * SECOND);
        assert_eq!(dog.look(start + 2994 * SECOND, &long), None);
        assert_eq!(dog.look(start + 2995 * SECOND, &long), Some(Expired::TimeIsNear));
        assert_eq!(dog.look(start + 3594 * SECOND, &busy(8, Duration::ZERO)), None);
        assert_eq!(dog.look(start + 3600 * SECOND, &long), Some(Expired::TimeIsUp));
        let (mut dog, start) = watchdog(None, Some(4));
        assert_eq!(dog.look(start + SECOND, &long), None, "half of a short limit stays for work");
    }

    #[test]
    fn a_worker_without_bounds_never_ends_by_itself() {
        let (mut dog, start) = watchdog(None, None);
        assert_eq!(dog.look(start + 1_000_000 * SECOND, &StatsSnapshot::default()), None);
        assert!(!Lifetime::default().is_bounded());
    }
}

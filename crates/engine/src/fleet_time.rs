//! Measures how much of the slots' time leads to results.

use std::time::Duration;

use crate::Instant;

/// The sums of the times that the fleet's slots have existed and computed.
#[derive(Debug, Clone, Copy)]
pub struct FleetTime {
    now: Instant,
    n_slots: usize,
    capacity_s: f64,
    busy_s: f64,
}

impl FleetTime {
    /// A fleet without slots.
    pub fn new(now: Instant) -> Self {
        Self { now, n_slots: 0, capacity_s: 0.0, busy_s: 0.0 }
    }

    /// Number of slots.
    pub fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// Time that slots have existed, summed over slots, s.
    pub fn capacity_s(&self) -> f64 {
        self.capacity_s
    }

    /// The part of [`Self::capacity_s`] that led to results, s.
    pub fn busy_s(&self) -> f64 {
        self.busy_s
    }

    /// Counts the time up to now.
    pub fn advance(&mut self, now: Instant) {
        let elapsed = now.saturating_duration_since(self.now);
        self.capacity_s += elapsed.as_secs_f64() * self.n_slots as f64;
        self.now = self.now.max(now);
    }

    /// Sets the number of slots.
    pub fn set_slots(&mut self, now: Instant, n_slots: usize) {
        self.advance(now);
        self.n_slots = n_slots;
    }

    /// Adds the computing time of a result.
    pub fn add_busy(&mut self, time: Duration) {
        self.busy_s += time.as_secs_f64();
    }

    /// Share of the slots' time since `start` without computation, 0 to 1.
    pub fn idle_share_since(&self, start: &Self) -> f64 {
        let capacity_s = self.capacity_s - start.capacity_s;
        if capacity_s > 0.0 {
            (1.0 - (self.busy_s - start.busy_s) / capacity_s).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}

/// One worker's computing time, in total and recently.
#[derive(Debug)]
pub struct WorkerTime {
    n_slots: usize,
    joined: Instant,
    busy: Duration,
    /// The last two windows: a full one and one that fills up.
    previous: Window,
    current: Window,
}

#[derive(Debug, Clone, Copy)]
struct Window {
    start: Instant,
    n_results: u64,
    busy: Duration,
}

const WINDOW_LEN: Duration = Duration::from_secs(30);

impl WorkerTime {
    /// A worker that has just joined.
    pub fn new(now: Instant, n_slots: usize) -> Self {
        let window = Window { start: now, n_results: 0, busy: Duration::ZERO };
        Self { n_slots, joined: now, busy: Duration::ZERO, previous: window, current: window }
    }

    /// Counts a result. Returns the plausible part of `compute_time`: a worker's slots cannot have
    /// computed for longer than they exist, nor for longer than the item has been `assigned`.
    pub fn add_result(
        &mut self,
        now: Instant,
        assigned: Instant,
        compute_time: Duration,
    ) -> Duration {
        let exists = now.saturating_duration_since(self.joined) * self.n_slots as u32;
        let busy = compute_time
            .min(now.saturating_duration_since(assigned))
            .min(exists.saturating_sub(self.busy));
        self.busy += busy;
        self.turn_windows(now);
        self.current.n_results += 1;
        self.current.busy += busy;
        busy
    }

    fn turn_windows(&mut self, now: Instant) {
        if now.saturating_duration_since(self.current.start) >= WINDOW_LEN {
            self.previous = self.current;
            self.current = Window { start: now, n_results: 0, busy: Duration::ZERO };
        }
    }

    /// Results per second, and idle share, of about the last minute.
    pub fn recent(&self, now: Instant) -> (f64, f64) {
        let elapsed_s = now.saturating_duration_since(self.previous.start).as_secs_f64();
        let is_first = self.previous.start == self.current.start;
        let (n_results, busy) = if is_first {
            (self.current.n_results, self.current.busy)
        } else {
            let (a, b) = (&self.previous, &self.current);
            (a.n_results + b.n_results, a.busy + b.busy)
        };
        if elapsed_s <= 0.0 {
            return (0.0, 1.0);
        }
        let busy_share = busy.as_secs_f64() / (elapsed_s * self.n_slots as f64);
        (n_results as f64 / elapsed_s, (1.0 - busy_share).clamp(0.0, 1.0))
    }

    /// When the worker joined.
    pub fn joined(&self) -> Instant {
        self.joined
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn no_worker_computes_for_longer_than_it_exists() {
        let start = Instant::after_origin(Duration::ZERO);
        let mut time = WorkerTime::new(start, 2);
        let now = start + SECOND;
        // One item counts at most the time since it was assigned; two slots count at most two
        // seconds.
        assert_eq!(time.add_result(now, start, Duration::MAX), SECOND);
        assert_eq!(time.add_result(now, start, SECOND / 2), SECOND / 2);
        assert_eq!(time.add_result(now, start, SECOND), SECOND / 2);
        assert_eq!(time.add_result(now, start, SECOND), Duration::ZERO);
        assert_eq!(time.recent(now), (4.0, 0.0));
    }

    #[test]
    fn old_results_are_forgotten() {
        let start = Instant::after_origin(Duration::ZERO);
        let mut time = WorkerTime::new(start, 1);
        for second in 1..=200 {
            let now = start + SECOND * second;
            let assigned = start + (SECOND * second - SECOND / 4);
            time.add_result(now, assigned, SECOND / if second <= 100 { 4 } else { 8 });
        }
        let (per_s, idle) = time.recent(start + SECOND * 200);
        assert!((per_s - 1.0).abs() < 0.05 && (idle - 0.875).abs() < 0.01, "{per_s} {idle}");
    }
}

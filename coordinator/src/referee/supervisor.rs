//! Starts the referee process for an item, and ends it after a time without items.

use std::{
    sync::{Arc, Mutex, MutexGuard, Weak},
    time::{Duration, Instant},
};

use tokio::{task::JoinSet, time::sleep};

use engine::{RefereeRequest, Verdict};

use super::{RefereeProgram, RefereeStats, process::Process};
use crate::clock;

/// Evaluates items in a process of its own, one at a time. Clones share the process;
/// when the last one is dropped, it is killed.
#[derive(Debug, Clone)]
pub struct Referee {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    program: RefereeProgram,
    idle_time: Duration,
    /// Locked during an item; others wait for the lock, first come, first served.
    state: tokio::sync::Mutex<State>,
    stats: Mutex<RefereeStats>,
}

#[derive(Debug, Default)]
struct State {
    /// `None` before the first item, after a death, and after a time without items.
    process: Option<Process>,
    /// Ends the process after a time without items.
    idle_timer: JoinSet<()>,
}

impl Referee {
    /// A referee without a process yet. `idle_time`: how long to keep the process without an
    /// item.
    pub fn new(program: RefereeProgram, idle_time: Duration) -> Self {
        let (state, stats) = Default::default();
        Self { shared: Arc::new(Shared { program, idle_time, state, stats }) }
    }

    /// Evaluates an item, after all earlier ones. Items may take minutes, so the caller limits
    /// their number and the time to wait. Dropping the future drops the item, and kills the
    /// process if it is computing the item.
    pub async fn evaluate(&self, request: &RefereeRequest) -> Verdict {
        let Shared { program, idle_time, state, .. } = &*self.shared;
        let mut state = state.lock().await;
        state.idle_timer = JoinSet::new();
        let busy = BusyTime { shared: &self.shared, since: clock::now() };
        // Taken out, so that it is killed if this future is dropped.
        let (verdict, process) = match state.process.take_if(|process| process.is_alive()) {
            Some(process) => match process.evaluate(request).await {
                // The process may have been killed just before it got the item. Only the death of
                // a process that was started for the item counts against the item.
                (Verdict::Died(_), _) => evaluate_afresh(program, request).await,
                evaluated => evaluated,
            },
            None => evaluate_afresh(program, request).await,
        };
        drop(busy);
        if process.is_some() {
            let shared = Arc::downgrade(&self.shared);
            state.idle_timer.spawn(end_idle(shared, *idle_time));
        }
        state.process = process;
        self.shared.count(&verdict);
        verdict
    }

    /// Statistics so far.
    pub fn stats(&self) -> RefereeStats {
        *self.shared.stats()
    }
}

/// Evaluates an item in a new process.
async fn evaluate_afresh(
    program: &RefereeProgram,
    request: &RefereeRequest,
) -> (Verdict, Option<Process>) {
    match Process::start(program).await {
        Ok(process) => process.evaluate(request).await,
        Err(reason) => (Verdict::Unavailable(reason), None),
    }
}

impl Shared {
    fn stats(&self) -> MutexGuard<'_, RefereeStats> {
        self.stats.lock().expect("nothing panics while it holds the statistics")
    }

    fn count(&self, verdict: &Verdict) {
        let mut stats = self.stats();
        *match verdict {
            Verdict::Values(_) => &mut stats.n_values,
            Verdict::Failed(_) => &mut stats.n_failed,
            Verdict::Died(_) => &mut stats.n_died,
            Verdict::Unavailable(_) => &mut stats.n_unavailable,
        } += 1;
    }
}

/// Adds the time since its creation to the statistics when it is dropped.
struct BusyTime<'a> {
    shared: &'a Shared,
    since: Instant,
}

impl Drop for BusyTime<'_> {
    fn drop(&mut self) {
        self.shared.stats().busy += clock::now().saturating_duration_since(self.since);
    }
}

/// Waits, then ends the process, unless an item aborts this task.
async fn end_idle(shared: Weak<Shared>, idle_time: Duration) {
    sleep(idle_time).await;
    let Some(shared) = shared.upgrade() else { return };
    let process = shared.state.lock().await.process.take();
    drop(shared);
    if let Some(process) = process {
        process.end().await;
    }
}

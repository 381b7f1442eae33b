//! The connections of those who have not made a call yet that was let in. They have
//! places of their own, so that they cannot keep out the others, and when another comes,
//! one has to go: the oldest that has said nothing, else the oldest. Synchronous.

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use crate::limits::{SILENT_STRANGER_GRACE, STRANGER_GRACE, STRANGERS_MAX};

/// Names a connection among strangers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct StrangerId(u64);

/// Strangers by age: since when they are there, and what tells them that they have to go.
type ByAge = BTreeMap<StrangerId, (Instant, CancellationToken)>;

/// The strangers.
#[derive(Debug, Default)]
pub struct Strangers {
    silent: ByAge,
    heard: ByAge,
    n_seen: u64,
}

impl Strangers {
    fn is_full(&self) -> bool {
        self.silent.len() + self.heard.len() >= STRANGERS_MAX
    }

    /// How long the next one has to wait for a place: until one of those who are there has
    /// had time to introduce itself.
    pub fn time_to_place(&self, now: Instant) -> Duration {
        if !self.is_full() {
            return Duration::ZERO;
        }
        self.time_of_silent(now).min(self.time_of_heard(now))
    }

    fn time_of_silent(&self, now: Instant) -> Duration {
        time_left(&self.silent, SILENT_STRANGER_GRACE, now)
    }

    fn time_of_heard(&self, now: Instant) -> Duration {
        time_left(&self.heard, STRANGER_GRACE, now)
    }

    /// A stranger comes. `has_to_go` tells it when it has to go. Returns whether another
    /// had to.
    pub fn enter(&mut self, now: Instant, has_to_go: CancellationToken) -> (StrangerId, bool) {
        let is_full = self.is_full();
        if is_full {
            let candidates = if self.time_of_silent(now) <= self.time_of_heard(now) {
                &mut self.silent
            } else {
                &mut self.heard
            };
            if let Some((_, (_, oldest))) = candidates.pop_first() {
                oldest.cancel();
            }
        }
        self.n_seen += 1;
        let id = StrangerId(self.n_seen);
        self.silent.insert(id, (now, has_to_go));
        (id, is_full)
    }

    /// One has said something.
    pub fn on_heard(&mut self, id: StrangerId) {
        if let Some(stranger) = self.silent.remove(&id) {
            self.heard.insert(id, stranger);
        }
    }

    /// One has gone, or is no stranger any more.
    pub fn leave(&mut self, id: StrangerId) {
        self.silent.remove(&id);
        self.heard.remove(&id);
    }
}

/// How long the oldest of some has still to introduce itself.
fn time_left(strangers: &ByAge, grace: Duration, now: Instant) -> Duration {
    let oldest = strangers.first_key_value();
    oldest.map_or(Duration::MAX, |(_, (since, _))| {
        grace.saturating_sub(now.saturating_duration_since(*since))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As many as there are places for, since `now`.
    fn full(now: Instant) -> (Strangers, Vec<(StrangerId, CancellationToken)>) {
        let mut strangers = Strangers::default();
        let enter = |_| {
            assert_eq!(strangers.time_to_place(now), Duration::ZERO);
            let token = CancellationToken::new();
            let (id, has_ended_another) = strangers.enter(now, token.clone());
            assert!(!has_ended_another);
            (id, token)
        };
        let entered = (0..STRANGERS_MAX).map(enter).collect();
        (strangers, entered)
    }

    #[test]
    fn one_stranger_too_many_ends_the_oldest_silent_one() {
        let now = Instant::now();
        let (mut strangers, entered) = full(now);
        strangers.on_heard(entered[0].0);
        assert_eq!(strangers.time_to_place(now), SILENT_STRANGER_GRACE);
        let later = now + SILENT_STRANGER_GRACE;
        assert_eq!(strangers.time_to_place(later), Duration::ZERO);
        let (_, has_ended_another) = strangers.enter(later, CancellationToken::new());
        assert!(has_ended_another);
        let ended: Vec<usize> =
            (0..STRANGERS_MAX).filter(|&i| entered[i].1.is_cancelled()).collect();
        assert_eq!(ended, [1]);
    }

    #[test]
    fn those_who_speak_have_more_time() {
        let now = Instant::now();
        let (mut strangers, entered) = full(now);
        entered.iter().for_each(|(id, _)| strangers.on_heard(*id));
        assert_eq!(strangers.time_to_place(now), STRANGER_GRACE);
        strangers.enter(now + STRANGER_GRACE, CancellationToken::new());
        assert!(entered[0].1.is_cancelled());
    }

    #[test]
    fn who_leaves_or_is_let_in_makes_a_place() {
        let now = Instant::now();
        let (mut strangers, entered) = full(now);
        strangers.on_heard(entered[0].0);
        for (id, _) in &entered[..2] {
            strangers.leave(*id);
            assert_eq!(strangers.time_to_place(now), Duration::ZERO);
            assert!(!strangers.enter(now, CancellationToken::new()).1);
        }
        assert!(entered.iter().all(|(_, token)| !token.is_cancelled()));
    }
}

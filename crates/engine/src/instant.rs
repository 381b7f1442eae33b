//! The engine's time.

use std::{
    ops::{Add, AddAssign},
    time::Duration,
};

/// A moment, as the time since an origin of the caller's choice. The standard library's type of
/// this name has no value without a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Instant(Duration);

impl Instant {
    /// The moment this long after the origin.
    pub const fn after_origin(time: Duration) -> Self {
        Self(time)
    }

    /// The time since an earlier moment; zero if that is later.
    pub fn saturating_duration_since(self, earlier: Self) -> Duration {
        self.0.saturating_sub(earlier.0)
    }
}

impl Add<Duration> for Instant {
    type Output = Self;

    fn add(self, time: Duration) -> Self {
        Self(self.0 + time)
    }
}

impl AddAssign<Duration> for Instant {
    fn add_assign(&mut self, time: Duration) {
        self.0 += time;
    }
}

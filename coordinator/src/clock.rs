//! The one place where the coordinator reads the clock.
#![expect(clippy::disallowed_methods, reason = "the shell has to read the clock somewhere")]

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Monotonic time, for durations and deadlines.
pub fn now() -> Instant {
    Instant::now()
}

/// Milliseconds since 1970 UTC, for people to read.
pub fn unix_ms() -> u64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since_epoch.as_millis() as u64
}

//! The one place where the coordinator reads the clock.
#![expect(clippy::disallowed_methods, reason = "the shell has to read the clock somewhere")]

use std::{
    sync::OnceLock,
    time::{Instant, SystemTime, UNIX_EPOCH},
};

/// Monotonic time, for durations and deadlines.
pub fn now() -> Instant {
    Instant::now()
}

/// The same for the engine.
pub fn engine_now() -> engine::Instant {
    static ORIGIN: OnceLock<Instant> = OnceLock::new();
    engine::Instant::after_origin(ORIGIN.get_or_init(now).elapsed())
}

/// The present time, to compare with dates.
pub fn today() -> SystemTime {
    SystemTime::now()
}

/// Milliseconds since 1970 UTC, for people to read.
pub fn unix_ms() -> u64 {
    let since_epoch = today().duration_since(UNIX_EPOCH).unwrap_or_default();
    since_epoch.as_millis() as u64
}

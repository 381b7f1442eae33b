//! Keeps strangers from filling the log.

use std::time::Instant;

use crate::limits::STRANGER_LOG_INTERVAL;

/// Lets one line through per interval and counts the others.
#[derive(Debug, Default)]
pub struct Throttle {
    logged_at: Option<Instant>,
    n_withheld: u64,
}

impl Throttle {
    /// Whether a line is due; if so, how many were withheld since the last one.
    pub fn on_line(&mut self, now: Instant) -> Option<u64> {
        let is_due = |at| now.saturating_duration_since(at) >= STRANGER_LOG_INTERVAL;
        if self.logged_at.is_none_or(is_due) {
            self.logged_at = Some(now);
            return Some(std::mem::take(&mut self.n_withheld));
        }
        self.n_withheld += 1;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock;

    #[test]
    fn one_line_per_interval_says_how_many_there_were() {
        let now = clock::now();
        let mut throttle = Throttle::default();
        assert_eq!(throttle.on_line(now), Some(0));
        assert_eq!(throttle.on_line(now), None);
        assert_eq!(throttle.on_line(now + STRANGER_LOG_INTERVAL / 2), None);
        assert_eq!(throttle.on_line(now + STRANGER_LOG_INTERVAL), Some(2));
        assert_eq!(throttle.on_line(now + STRANGER_LOG_INTERVAL * 2), Some(0));
    }
}

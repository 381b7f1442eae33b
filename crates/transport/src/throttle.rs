//! Limits log lines that strangers can cause.

use std::time::{Duration, Instant};

/// Lets one line through per interval and counts the others.
#[derive(Debug, Default)]
pub struct Throttle {
    logged_at: Option<Instant>,
    n_withheld: u64,
}

impl Throttle {
    /// Least time between two lines.
    pub const INTERVAL: Duration = Duration::from_secs(1);

    /// Returns the number of withheld lines since the last one if a line is due, otherwise
    /// `None`.
    pub fn on_line(&mut self, now: Instant) -> Option<u64> {
        let is_due = |at| now.saturating_duration_since(at) >= Self::INTERVAL;
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

    #[test]
    #[expect(clippy::disallowed_methods, reason = "any instant will do")]
    fn one_line_per_interval_counts_the_others() {
        let now = Instant::now();
        let mut throttle = Throttle::default();
        assert_eq!(throttle.on_line(now), Some(0));
        assert_eq!(throttle.on_line(now), None);
        assert_eq!(throttle.on_line(now + Throttle::INTERVAL / 2), None);
        assert_eq!(throttle.on_line(now + Throttle::INTERVAL), Some(2));
        assert_eq!(throttle.on_line(now + Throttle::INTERVAL * 2), Some(0));
    }
}

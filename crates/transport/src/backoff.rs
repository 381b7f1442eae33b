//! Delays before reconnections: exponential, with full jitter.
//!
//! Full jitter (a delay uniform between 0 and a bound that doubles) spreads a
//! whole fleet evenly over time when its coordinator comes back; see M. Brooker,
//! "Exponential Backoff And Jitter", AWS Architecture Blog, 2015.

use std::time::Duration;

/// The delays of one series of attempts.
#[derive(Debug, Clone)]
pub struct Backoff {
    min: Duration,
    max: Duration,
    bound: Duration,
}

impl Backoff {
    /// Delays up to `min` at first, and up to `max` in the end.
    pub fn new(min: Duration, max: Duration) -> Self {
        Self { min, max, bound: min }
    }

    /// The next delay; `uniform` is a random number in \[0, 1).
    pub fn next_delay(&mut self, uniform: f64) -> Duration {
        let delay = self.bound.mul_f64(uniform);
        self.bound = self.bound.saturating_mul(2).min(self.max);
        delay
    }

    /// Starts over after a success.
    pub fn reset(&mut self) {
        self.bound = self.min;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn backoff() -> Backoff {
        Backoff::new(Duration::from_millis(100), Duration::from_millis(500))
    }

    #[test]
    fn the_bound_doubles_up_to_the_maximum() {
        let mut backoff = backoff();
        let delays: Vec<u128> = (0..5).map(|_| backoff.next_delay(1.0).as_millis()).collect();
        assert_eq!(delays, [100, 200, 400, 500, 500]);
    }

    #[test]
    fn delays_are_anywhere_below_the_bound() {
        assert_eq!(backoff().next_delay(0.0), Duration::ZERO);
        assert_eq!(backoff().next_delay(0.25), Duration::from_millis(25));
    }

    #[test]
    fn a_success_starts_the_delays_over() {
        let mut backoff = backoff();
        for _ in 0..100 {
            backoff.next_delay(0.5);
        }
        backoff.reset();
        assert_eq!(backoff.next_delay(1.0), Duration::from_millis(100));
    }
}

//! Times for people; the only module that reads the clock.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Milliseconds since 1970 UTC.
pub fn unix_ms() -> u64 {
    today().duration_since(UNIX_EPOCH).unwrap_or_default().as_millis() as u64
}

/// The present time, to compare dates with.
#[expect(clippy::disallowed_methods, reason = "ages are relative to now")]
pub fn today() -> SystemTime {
    SystemTime::now()
}

/// The present time, to measure durations with.
#[expect(clippy::disallowed_methods, reason = "speeds are measured from now")]
pub fn now() -> Instant {
    Instant::now()
}

/// A time in UTC as in RFC 3339, to the second.
pub fn utc(at_ms: u64) -> String {
    let seconds = at_ms / 1000;
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = date(days);
    let (hour, minute) = (second / 3600, second / 60 % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}Z", second % 60)
}

/// Year, month and day of a day after 1970-01-01: Howard Hinnant's
/// `civil_from_days`, without the years before 1970.
fn date(days: u64) -> (u64, u64, u64) {
    // Days since 0000-03-01: leap days come last.
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    (400 * era + year_of_era + u64::from(month <= 2), month, day)
}

/// A duration in its two largest units.
pub fn duration(duration: Duration) -> String {
    let seconds = duration.as_secs();
    match seconds {
        0 if !duration.is_zero() => format!("{} ms", duration.as_millis()),
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        3600..86_400 => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
        _ => format!("{} d {} h", seconds / 86_400, seconds / 3600 % 24),
    }
}

/// A duration in milliseconds.
pub fn duration_ms(ms: u64) -> String {
    duration(Duration::from_millis(ms))
}

/// The age of a time; 0 if the time is in the future because clocks differ.
pub fn ago(at_ms: u64, now_ms: u64) -> String {
    let age = Duration::from_secs(now_ms.saturating_sub(at_ms) / 1000);
    format!("{} ago", duration(age))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_agree_with_the_calendar() {
        // `date --utc --date=@SECONDS --iso-8601=seconds` prints the same.
        for (seconds, expected) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
            (1_767_225_599, "2025-12-31T23:59:59Z"),
        ] {
            assert_eq!(utc(seconds * 1000), expected);
        }
    }

    #[test]
    fn durations_have_two_units_at_most() {
        let texts = [0, 59, 60, 3599, 3600, 86_399, 90_000].map(Duration::from_secs).map(duration);
        let expected =
            ["0 s", "59 s", "1 min 0 s", "59 min 59 s", "1 h 0 min", "23 h 59 min", "1 d 1 h"];
        assert_eq!(texts, expected);
        assert_eq!(duration(Duration::from_millis(250)), "250 ms");
        assert_eq!(ago(5000, 3000), "0 s ago", "clocks differ");
        assert_eq!(ago(3000, 65_999), "1 min 2 s ago");
    }
}

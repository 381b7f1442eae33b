//! Times on command lines.

use std::time::Duration;

/// Parses a time with its unit: s, m or h, such as 90s, 15m or 2h.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let n_digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let (number, unit) = text.split_at(n_digits);
    let unit_s = match unit {
        "s" => 1,
        "m" => 60,
        "h" => 3600,
        _ => return Err("expected a number and its unit: 90s, 15m or 2h".into()),
    };
    let number: u32 = number.parse().map_err(|_| "expected a smaller number")?;
    Ok(Duration::from_secs(u64::from(number) * unit_s))
}

/// The same for a time that must be more than 0.
pub fn parse_positive_duration(text: &str) -> Result<Duration, String> {
    match parse_duration(text)? {
        Duration::ZERO => Err("must be more than 0".into()),
        duration => Ok(duration),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_unit() {
        assert_eq!(parse_duration("15m"), Ok(Duration::from_secs(900)));
        assert_eq!(parse_duration("2h"), Ok(Duration::from_secs(7200)));
        for wrong in ["", "5", "s", "1d", "-1s", "99999999999h"] {
            parse_duration(wrong).unwrap_err();
        }
        parse_duration("0s").unwrap();
        parse_positive_duration("0s").unwrap_err();
    }
}

//! Makes text from the network fit for people.

use swarm_telemetry::is_unprintable;

use crate::limits::TEXT_LEN_MAX;

/// Makes text from the network fit for a log and a terminal: bounded, on one line, and in reading
/// order.
pub fn printable(text: &str) -> String {
    let end = text.floor_char_boundary(TEXT_LEN_MAX);
    text[..end].chars().map(|c| if is_unprintable(c) { ' ' } else { c }).collect()
}

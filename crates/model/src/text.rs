//! Text from the network, made fit for people to read.

use swarm_telemetry::is_unprintable;

use crate::limits::TEXT_LEN_MAX;

/// Text from the network, fit for a log and a terminal: bounded, on one line, and
/// in the order in which it is read.
pub fn printable(text: &str) -> String {
    let end = text.floor_char_boundary(TEXT_LEN_MAX);
    text[..end].chars().map(|c| if is_unprintable(c) { ' ' } else { c }).collect()
}

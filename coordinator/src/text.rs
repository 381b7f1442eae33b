//! Text from the network, made fit for people to read.

use crate::limits::TEXT_LEN_MAX;

/// Text from the network, fit for a log and a terminal: bounded, on one line, and
/// in the order in which it is read.
pub fn printable(text: &str) -> String {
    let end = text.floor_char_boundary(TEXT_LEN_MAX);
    let is_unfit = |c: char| {
        // Line and paragraph separators; marks that change the direction of text.
        c.is_control()
            || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    text[..end].chars().map(|c| if is_unfit(c) { ' ' } else { c }).collect()
}

//! Checks names, and suggests known names for unknown ones.

use super::Excerpt;
use crate::limits;

/// Whether a name can be shown to people.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let (n, limit) = (name.chars().count(), limits::NAME_CHARS);
    if n == 0 {
        Err("a name must not be empty".to_owned())
    } else if n > limit {
        Err(format!("a name must have at most {limit} characters, not {n}"))
    } else if name.chars().any(char::is_control) {
        Err("a name must not contain control characters".to_owned())
    } else {
        Ok(())
    }
}

/// The message for a name that is not among `expected`. `unsupported`: names that only
/// SpikeSwarmSim knows.
pub(crate) fn unknown_name(name: &str, expected: &[&str], unsupported: &[&str]) -> String {
    if unsupported.contains(&name) {
        format!("not supported: `{name}`; {}", known_names(expected))
    } else {
        format!("unknown name `{}`; {}", Excerpt(name), suggestion(name, expected))
    }
}

/// The nearest known name, or all of them if none is near.
pub fn suggestion<S: AsRef<str>>(name: &str, known: &[S]) -> String {
    // A longer name resembles no known name, and a comparison would take quadratic time.
    let comparable = name.len() <= limits::NAME_CHARS;
    let name = name.to_lowercase();
    let similarity = |known: &S| strsim::jaro_winkler(&name, &known.as_ref().to_lowercase());
    let nearest = known.iter().filter(|_| comparable).map(|known| (similarity(known), known));
    match nearest.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((similarity, nearest)) if similarity > 0.8 => {
            format!("did you mean `{}`?", nearest.as_ref())
        }
        _ => known_names(known),
    }
}

fn known_names<S: AsRef<str>>(known: &[S]) -> String {
    /// Most names to list.
    const SHOWN: usize = 16;
    let quoted = known.iter().take(SHOWN).map(|name| format!("`{}`", Excerpt(name.as_ref())));
    let quoted: Vec<String> = quoted.collect();
    let rest = if known.len() > SHOWN { ", ..." } else { "" };
    if quoted.is_empty() {
        "none is allowed here".to_owned()
    } else {
        format!("known: {}{rest}", quoted.join(", "))
    }
}

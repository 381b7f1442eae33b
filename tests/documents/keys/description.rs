//! The description of a key, taken apart: its meaning, its unit, its default.

use serde_json::Value;

const UNITS: [&str; 14] = [
    "cm", "cm/s", "ms", "1/ms", "s", "steps", "substeps", "radians", "mV", "mM", "mS/cm2",
    "uF/cm2", "kg", "N",
];

/// The parts that `Parameter::description` has put together.
pub struct Description {
    pub meaning: String,
    /// Empty if there is none.
    pub unit: &'static str,
    /// Empty if the description has no default.
    pub default: String,
}

impl Description {
    pub fn read(value: &Value) -> Self {
        let text = sentence(value);
        let (first, rest) = text.split_at(first_sentence(&text));
        let (meaning, default) = first.split_once("; default ").unwrap_or((first, ""));
        let with_unit = UNITS.iter().find_map(|unit| {
            let before = meaning.strip_suffix(unit)?.strip_suffix(", ")?;
            Some((before, *unit))
        });
        let (meaning, unit) = with_unit.unwrap_or((meaning, ""));
        Self { meaning: format!("{meaning}{rest}"), unit, default: in_code(default) }
    }
}

/// A description on one line of a table.
pub fn sentence(value: &Value) -> String {
    let text = value["description"].as_str().unwrap_or_default();
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

/// The end of the first sentence, before its full stop.
fn first_sentence(text: &str) -> usize {
    let starts = |at: &usize| text[at + 2..].starts_with(|c: char| c.is_uppercase() || c == '`');
    let end = text.match_indices(". ").map(|(at, _)| at).find(starts);
    end.unwrap_or_else(|| text.trim_end_matches('.').len())
}

/// A default, marked as code if it is a value of a file.
fn in_code(default: &str) -> String {
    let is_value = default.parse::<f64>().is_ok() || ["true", "false", "null"].contains(&default);
    if is_value || default.starts_with('"') {
        format!("`{}`", default.trim_matches('"'))
    } else if let Some(rest) = default.strip_prefix("null:") {
        format!("`null`:{rest}")
    } else {
        default.to_owned()
    }
}

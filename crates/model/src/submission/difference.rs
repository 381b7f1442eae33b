//! Compares two experiment files.

use serde_json::Value;

/// Most lines.
const LINES_MAX: usize = 50;
/// Most characters of a value.
const VALUE_LEN_MAX: usize = 60;

/// The differences of two files in canonical form, one line per value: `PATH: BEFORE -> AFTER`.
pub fn difference(before: &str, after: &str) -> Vec<String> {
    let read = |text| serde_json::from_str(text).unwrap_or(Value::Null);
    let mut lines = Vec::new();
    compare("", Some(&read(before)), Some(&read(after)), &mut lines);
    let n_lines = lines.len();
    lines.truncate(LINES_MAX);
    if n_lines > LINES_MAX {
        lines.push(format!("and {} more", n_lines - LINES_MAX));
    }
    lines
}

fn compare(path: &str, before: Option<&Value>, after: Option<&Value>, lines: &mut Vec<String>) {
    match (before, after) {
        _ if before == after => {}
        (Some(Value::Object(old)), Some(Value::Object(new))) => {
            let added = new.keys().filter(|key| !old.contains_key(*key));
            for key in old.keys().chain(added) {
                let place = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                compare(&place, old.get(key), new.get(key), lines);
            }
        }
        _ => lines.push(format!("{path}: {} -> {}", short(before), short(after))),
    }
}

fn short(value: Option<&Value>) -> String {
    let Some(value) = value else { return "nothing".to_owned() };
    let text = value.to_string();
    match text.char_indices().nth(VALUE_LEN_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_that_differs_has_its_line() {
        let before = r#"{"a": {"b": 1, "c": [1, 2], "d": "x"}, "e": 1, "f": {"g": 1}}"#;
        let after = r#"{"a": {"b": 2, "c": [1, 3], "d": "x"}, "f": 5, "h": null}"#;
        assert_eq!(
            difference(before, after),
            [
                "a.b: 1 -> 2",
                "a.c: [1,2] -> [1,3]",
                "e: 1 -> nothing",
                "f: {\"g\":1} -> 5",
                "h: nothing -> null"
            ]
        );
        assert!(difference(before, before).is_empty());
    }

    #[test]
    fn differences_are_bounded() {
        let long = |c: char| format!(r#"{{"a": "{}"}}"#, c.to_string().repeat(1000));
        assert!(difference(&long('é'), &long('b'))[0].len() < 250);
        let many = |value: u32| {
            let keys: Vec<String> = (0..80).map(|key| format!("\"{key}\": {value}")).collect();
            format!("{{{}}}", keys.join(", "))
        };
        let lines = difference(&many(1), &many(2));
        assert_eq!((lines.len(), lines[50].as_str()), (51, "and 30 more"));
    }
}

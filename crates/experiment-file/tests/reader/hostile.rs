//! Input that was never meant to be an experiment.

use proptest::prelude::*;

use super::{BASE, edited, read, refuse};
use experiment_file::limits;

#[test]
fn deep_nesting_is_refused_without_exhausting_a_small_stack() {
    let check = || {
        for unit in ["[", r#"{"a":"#, r#"{"topology":["#] {
            refuse(&unit.repeat(limits::FILE_BYTES / unit.len()));
        }
        let balanced = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
        let expected = "lists and objects nest 100000 deep, the limit is 64";
        assert_eq!(refuse(&balanced), expected);
        let strings = format!("[{}\"\\\"[[[\"]", "\"[{\",".repeat(100));
        assert_eq!(refuse(&strings), "line 1: expected an object, found a list");
    };
    let small = std::thread::Builder::new().stack_size(1 << 18);
    small.spawn(check).unwrap().join().unwrap();
}

#[test]
fn a_file_has_a_limited_size() {
    let padded = format!("{BASE}{}", " ".repeat(limits::FILE_BYTES));
    assert_eq!(
        refuse(&padded),
        format!("the file has {} bytes, the limit is 1048576", padded.len())
    );
}

#[test]
fn comments_and_trailing_commas_change_nothing() {
    let commented = BASE.replace(",\n", ", // a remark, with a \"quote\"\n");
    let commented = commented.replace("}", ", /* } */ }").replace("{, ", "{ ");
    assert_ne!(commented, BASE);
    assert_eq!(read(&commented), read(BASE));
}

#[test]
fn text_that_is_not_strict_json_is_refused_with_its_line() {
    for (text, expected) in [
        ("", "line 1: the file is empty"),
        ("\u{feff}", "line 1: the file is empty"),
        ("{\n  /* comment\n}", "line 2: not JSON: Unterminated comment block (column 3)"),
        ("{\"a\": 1,,\n}", "line 1: not JSON: Unexpected token in object (column 9)"),
        ("{\"a\": NaN}", "line 1: not JSON: Unexpected token (column 7)"),
        ("{\"a\": -Infinity}", "line 1: not JSON: Infinity and NaN are not allowed (column 7)"),
        ("{\"a\": 01}", "line 1: not JSON: Expected comma (column 8)"),
        ("{\"a\": 'b'}", "line 1: not JSON: Single-quoted strings are not allowed (column 7)"),
        ("{} {}", "line 1: not JSON: Text cannot contain more than one JSON value (column 4)"),
        (
            "{\"a\": \"\u{1}\"}",
            "line 1: not JSON: control character (\\u0000-\\u001F) found while parsing a string \
             (column 7)",
        ),
        (
            "{\"a\": \"\\ud800\"}",
            "line 1: not JSON: Invalid unicode escape sequence. 'd800 (unpaired high surrogate)' is \
             not a valid UTF8 character (column 8)",
        ),
    ] {
        assert_eq!(refuse(text), expected, "{text:?}");
    }
}

#[test]
fn numbers_that_no_double_holds_are_refused() {
    for number in ["1e999", "-1e999", "1e1000000000000"] {
        let text = edited(r#""max_vals": 3"#, &format!(r#""max_vals": {number}"#));
        assert_eq!(
            refuse(&text),
            format!(
                "line 43: algorithm.populations.weights.max_vals: must be between -1000000000 and \
                 1000000000, is {number}"
            )
        );
    }
    let digits = "9".repeat(400);
    let problems = refuse(&edited(r#""generations": 10"#, &format!(r#""generations": {digits}"#)));
    assert!(problems.contains("must be between 1 and 10000000, is 999") && problems.len() < 300);
}

#[test]
fn a_file_full_of_problems_has_a_short_report() {
    let keys: Vec<String> = (0..200).map(|i| format!("\"key{i}\": {i}")).collect();
    let problems =
        read(&edited(r#""name": "base","#, &format!("{},", keys.join(", ")))).unwrap_err().problems;
    assert_eq!(problems.len(), limits::PROBLEMS + 1);
    assert_eq!(problems.last().unwrap().to_string(), "and 100 more problems");
}

#[test]
fn long_and_strange_names_are_shown_shortened_and_on_one_line() {
    let long = format!("{}\\n{}", "x".repeat(100), "y".repeat(10_000));
    let problems = refuse(&edited(r#""name": "base","#, &format!(r#""{long}": 1,"#)));
    assert!(problems.contains("xxx\\nyyy") && problems.contains('…'), "{problems}");
    assert!(problems.lines().count() == 1 && problems.len() < 800, "{problems}");
}

proptest! {
    #[test]
    fn any_text_is_read_or_refused(text in ".{0,200}") {
        let _ = read(&text);
    }

    /// Typing errors: pieces are cut out, doubled or overwritten.
    #[test]
    fn any_damaged_file_is_read_or_refused(
        cuts in prop::collection::vec((0..BASE.len(), 0_usize..40, ".{0,6}"), 1..4)
    ) {
        let mut text = BASE.to_owned();
        for (start, len, insert) in cuts {
            let start = start.min(text.len());
            let end = (start + len).min(text.len());
            if text.is_char_boundary(start) && text.is_char_boundary(end) {
                text.replace_range(start..end, &insert);
            }
        }
        if let Err(error) = read(&text) {
            prop_assert!(!error.problems.is_empty());
        }
    }

    /// Every value and key in turn becomes some other JSON.
    #[test]
    fn any_transplanted_file_is_read_or_refused(
        tokens in prop::collection::vec((any::<prop::sample::Index>(), 0..REPLACEMENTS.len()), 1..6)
    ) {
        let mut pieces: Vec<&str> = split_tokens(BASE);
        let places: Vec<usize> = (0..pieces.len()).filter(|&i| is_scalar(pieces[i])).collect();
        for (index, replacement) in tokens {
            pieces[places[index.index(places.len())]] = REPLACEMENTS[replacement];
        }
        if let Err(error) = read(&pieces.concat()) {
            prop_assert!(!error.problems.is_empty());
        }
    }
}

const REPLACEMENTS: [&str; 16] = [
    "null",
    "true",
    "-1",
    "0",
    "1e300",
    "1e-300",
    "4294967296",
    "18446744073709551616",
    "0.5",
    "\"\"",
    "\"all\"",
    "\"H\"",
    "[]",
    "{}",
    "[[500, 500]]",
    "\"\\ud83d\\ude00\"",
];

/// Cuts JSON into strings, other scalars, and everything between.
fn split_tokens(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let len = if let Some(string) = rest.strip_prefix('"') {
            string.find('"').map_or(rest.len(), |end| end + 2)
        } else {
            let is_part = |c: char| is_scalar(&rest[..1]) == is_scalar(c.encode_utf8(&mut [0; 4]));
            rest.find(|c: char| c == '"' || !is_part(c)).unwrap_or(rest.len())
        };
        let (piece, tail) = rest.split_at(len);
        pieces.push(piece);
        rest = tail;
    }
    pieces
}

fn is_scalar(piece: &str) -> bool {
    piece.starts_with(|c: char| c == '"' || c == '-' || c == '.' || c.is_ascii_alphanumeric())
}

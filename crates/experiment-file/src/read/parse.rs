//! Parses text into a syntax tree that knows the place of every value.

use jsonc_parser::ast::Value;
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use serde::de::IgnoredAny;

use crate::{ConfigError, Problem, limits};

/// Parses strict JSON (RFC 8259) of bounded size and depth.
pub(crate) fn parse(text: &str) -> Result<Value<'_>, ConfigError> {
    if text.len() > limits::FILE_BYTES {
        let limit = limits::FILE_BYTES;
        let message = format!("the file has {} bytes, the limit is {limit}", text.len());
        return Err(syntax_error(None, message));
    }
    // The parser recurses, and limits only its stack, to half a megabyte, not its depth.
    let depth = nesting(text);
    if depth > limits::NESTING {
        let limit = limits::NESTING;
        let message = format!("lists and objects nest {depth} deep, the limit is {limit}");
        return Err(syntax_error(None, message));
    }
    let tree = match parse_to_ast(text, &CollectOptions::default(), &STRICT) {
        Ok(parsed) => parsed.value,
        Err(error) => {
            let message = format!("not JSON: {} (column {})", error.kind(), error.column_display());
            return Err(syntax_error(Some(error.line_display()), message));
        }
    };
    let Some(tree) = tree else {
        return Err(syntax_error(Some(1), "the file is empty".to_owned()));
    };
    // The parser is made for dialects, and accepts some invalid JSON, such as control characters
    // in strings; this check is strict.
    if let Err(error) = serde_json::from_str::<IgnoredAny>(text) {
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        let message = message.strip_suffix(&place).unwrap_or(&message);
        let message = format!("not JSON: {message} (column {})", error.column());
        return Err(syntax_error(Some(error.line()), message));
    }
    Ok(tree)
}

const STRICT: ParseOptions = ParseOptions {
    allow_comments: false,
    allow_loose_object_property_names: false,
    allow_trailing_commas: false,
    allow_missing_commas: false,
    allow_single_quoted_strings: false,
    allow_hexadecimal_numbers: false,
    allow_unary_plus_numbers: false,
    allow_bare_decimal_point_numbers: false,
    allow_non_finite_numbers: false,
    allow_extended_string_escapes: false,
};

/// The nesting depth of lists and objects in a JSON text; for any other text, at least the depth
/// that a parser can reach before it fails.
fn nesting(text: &str) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    let mut bytes = text.bytes();
    while let Some(byte) = bytes.next() {
        match byte {
            b'"' => {
                while let Some(byte) = bytes.next() {
                    match byte {
                        b'"' => break,
                        // An escaped character may be a quote.
                        b'\\' => drop(bytes.next()),
                        _ => {}
                    }
                }
            }
            b'[' | b'{' => {
                depth += 1;
                deepest = deepest.max(depth);
            }
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    deepest
}

fn syntax_error(line: Option<usize>, message: String) -> ConfigError {
    ConfigError { problems: vec![Problem { path: String::new(), line, message }] }
}

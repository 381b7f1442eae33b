//! The page on logs lists every line that the programs write at INFO and above.

use std::{collections::BTreeSet, fs, path::Path};

use harness::workspace_file;

/// Stands for a varying part of a message.
const VARYING: &str = "…";

/// A line as on the page: message, level, fields.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Line {
    message: String,
    level: String,
    fields: Vec<String>,
}

/// The lines of all sources below a directory.
fn lines_of(directory: &str) -> BTreeSet<Line> {
    let mut lines = BTreeSet::new();
    collect(&workspace_file(directory), &mut lines);
    lines
}

fn collect(path: &Path, lines: &mut BTreeSet<Line>) {
    if path.is_dir() {
        fs::read_dir(path).unwrap().for_each(|entry| collect(&entry.unwrap().path(), lines));
        return;
    }
    let name = path.file_name().unwrap().to_str().unwrap();
    // Skips tests, and lines that only tests of a debug build see.
    if !name.ends_with(".rs") || name == "tests.rs" || name == "failpoint.rs" {
        return;
    }
    let text = fs::read_to_string(path).unwrap();
    let code = text.split("#[cfg(test)]").next().unwrap();
    for level in ["info", "warn", "error"] {
        let call = format!("{level}!(");
        for (at, _) in code.match_indices(&call) {
            if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
                lines.insert(line(level, arguments(&code[at + call.len()..])));
            }
        }
    }
}

/// The arguments of a macro, up to its closing parenthesis.
fn arguments(code: &str) -> Vec<String> {
    let mut arguments = vec![String::new()];
    let (mut depth, mut in_text, mut is_escaped) = (0, false, false);
    for c in code.chars() {
        match c {
            _ if in_text => in_text = c != '"' || is_escaped,
            '"' => in_text = true,
            '(' | '[' | '{' => depth += 1,
            ')' if depth == 0 => break,
            ')' | ']' | '}' => depth -= 1,
            ',' if depth == 0 => {
                arguments.push(String::new());
                continue;
            }
            _ => {}
        }
        is_escaped = in_text && c == '\\' && !is_escaped;
        arguments.last_mut().unwrap().push(c);
    }
    arguments
}

/// Fields come before the message, and its format arguments after it.
fn line(level: &str, arguments: Vec<String>) -> Line {
    let mut fields = Vec::new();
    for argument in arguments {
        let argument = argument.trim();
        if let Some(text) = argument.strip_prefix('"') {
            let message = message(text.strip_suffix('"').unwrap());
            return Line { message, level: level.to_uppercase(), fields };
        }
        let field = argument.split('=').next().unwrap().trim();
        fields.push(field.trim_start_matches(['%', '?']).to_owned());
    }
    panic!("a line without a message: {fields:?}");
}

/// A message with a sign for each varying part.
fn message(literal: &str) -> String {
    let unescaped = literal.replace("\\\"", "\"");
    let mut pieces = unescaped.split("\\\n");
    let mut joined = pieces.next().unwrap().to_owned();
    pieces.for_each(|piece| joined.push_str(piece.trim_start()));
    let mut message = String::new();
    let mut rest = joined.as_str();
    while let Some((before, after)) = rest.split_once('{') {
        message.push_str(before);
        message.push_str(VARYING);
        rest = after.split_once('}').unwrap().1;
    }
    message + rest
}

/// The lines of a section of the page: ``| `message` | level | `field`, ... | when |``.
fn documented(page: &str, heading: &str) -> BTreeSet<Line> {
    let section = page.split("\n## ").find(|section| section.starts_with(heading)).unwrap();
    let rows = section.lines().filter(|row| row.starts_with("| `"));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let names = cells[2].split('`').skip(1).step_by(2);
        Line {
            message: cells[0].trim_matches('`').to_owned(),
            level: cells[1].to_owned(),
            fields: names.map(str::to_owned).collect(),
        }
    })
    .collect()
}

#[test]
fn the_page_on_logs_has_every_line_with_its_fields_and_no_other() {
    let page = fs::read_to_string(workspace_file("docs/logs.md")).unwrap();
    for (heading, directories) in [
        ("Coordinator", &["coordinator/src", "crates/model/src"][..]),
        ("Worker", &["worker/src"]),
        ("Both", &["crates/telemetry/src", "crates/transport/src"]),
    ] {
        let said: BTreeSet<Line> =
            directories.iter().flat_map(|directory| lines_of(directory)).collect();
        let documented = documented(&page, heading);
        assert!(said.len() > 2, "{said:#?}");
        let missing: Vec<&Line> = said.difference(&documented).collect();
        let superfluous: Vec<&Line> = documented.difference(&said).collect();
        assert!(missing.is_empty(), "{heading}: not on the page: {missing:#?}");
        assert!(superfluous.is_empty(), "{heading}: in no source: {superfluous:#?}");
    }
}

//! The page on programs' answers has every code of an error.

use std::{fmt::Write as _, fs, process::Command};

use harness::{binary, workspace_file};
use serde_json::Value;

use super::{expect_page, with_part};

const PAGE: &str = "docs/swarmctl.md";

/// A row for each code.
fn table() -> String {
    let mut command = Command::new(binary("swarmctl"));
    let output = command.args(["schema", "--of", "error"]).output().unwrap();
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    let codes = schema["$defs"]["Code"]["oneOf"].as_array().unwrap();
    let mut table = String::from("| code | exit code | |\n|---|---|---|\n");
    for code in codes {
        let text = code["description"].as_str().unwrap();
        let (exit, rest) = text.strip_prefix("Exit code ").unwrap().split_once(": ").unwrap();
        let (meaning, _) = rest.split_once(" Next: ").unwrap();
        let name = code["const"].as_str().unwrap();
        let _ = writeln!(table, "| `{name}` | {exit} | {} |", meaning.trim_end_matches('.'));
    }
    table
}

#[test]
fn the_page_on_swarmctl_has_every_code_of_an_error() {
    let page = fs::read_to_string(workspace_file(PAGE)).unwrap();
    expect_page(PAGE, &with_part(&page, "errors", &table()));
}

//! What the documents promise is tested by tests that exist.

use std::{collections::BTreeSet, fs, path::Path};

use harness::workspace_file;

use super::rust_files;

/// The names of the tests in a file: functions right after an attribute `test`.
fn tests_in(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let mut is_marked = false;
    let mut names = Vec::new();
    for line in text.lines().map(str::trim) {
        let signature = line.trim_start_matches("async ").strip_prefix("fn ");
        match signature.and_then(|rest| rest.split_once(['(', '<'])) {
            Some((name, _)) if is_marked => names.push(name.to_owned()),
            _ => {}
        }
        let is_attribute = line.starts_with("#[");
        is_marked =
            is_attribute && (is_marked || line.starts_with("#[test]") || line.contains("::test"));
    }
    names
}

#[test]
fn every_test_that_the_page_on_faults_names_exists() {
    let tests: BTreeSet<String> = ["tests", "coordinator", "crates/model", "worker", "client"]
        .iter()
        .flat_map(|directory| rust_files(&workspace_file(directory)))
        .flat_map(|path| tests_in(&path))
        .collect();
    let page = fs::read_to_string(workspace_file("docs/faults.md")).unwrap();
    // Between backticks, and with more underscores than anything else has.
    let named: Vec<&str> = page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|name| {
            name.matches('_').count() >= 3
                && name.chars().all(|c| c.is_ascii_lowercase() || c == '_')
        })
        .collect();
    assert!(named.len() > 20, "the page names tests: {named:?}");
    let missing: Vec<&&str> = named.iter().filter(|&&name| !tests.contains(name)).collect();
    assert!(missing.is_empty(), "no such tests: {missing:#?}");
}

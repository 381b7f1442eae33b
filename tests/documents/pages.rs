//! Every page that sources, messages and scripts name exists.

use std::{fs, path::Path};

use harness::workspace_file;

/// The pages that a text names, such as `docs/security.md`.
fn pages_in(text: &str) -> Vec<String> {
    let is_of_path = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    let mentions = text.match_indices("docs/").filter_map(|(at, _)| {
        let end = text[at..].find(|c| !is_of_path(c)).map_or(text.len(), |length| at + length);
        let (path, _) = text[at..end].rsplit_once(".md")?;
        Some(format!("{path}.md"))
    });
    mentions.collect()
}

/// The missing pages among those that the files below `path` name.
fn missing(path: &Path, found: &mut usize) -> Vec<String> {
    if path.is_dir() {
        let names = fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
        let sources = names.filter(|path| !path.ends_with("target"));
        return sources.flat_map(|path| missing(&path, found)).collect();
    }
    // Binary files name no pages.
    let pages = fs::read_to_string(path).map(|text| pages_in(&text)).unwrap_or_default();
    *found += pages.len();
    let absent = pages.into_iter().filter(|page| !workspace_file(page).exists());
    absent.map(|page| format!("{}: {page}", path.display())).collect()
}

#[test]
fn every_page_that_a_source_names_exists() {
    let mut found = 0;
    let missing: Vec<String> = [
        "client",
        "coordinator",
        "crates",
        "docker",
        "docs/deploy",
        "python",
        "sim-core",
        "tests",
        "worker",
    ]
    .iter()
    .flat_map(|directory| missing(&workspace_file(directory), &mut found))
    .collect();
    assert!(found > 30, "sources name pages: {found}");
    assert!(missing.is_empty(), "no such pages: {missing:#?}");
}

//! Documents and manifests agree with the sources, and with the output of the programs.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod algorithms;
mod errors;
mod keys;
mod logs;
mod metrics;
mod pages;
mod platforms;
mod programs;
mod targets;
mod tasks;
mod versions;
mod walks;

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use harness::workspace_file;

/// The text of a generated page. With the variable `UPDATE_DOCS`, the page becomes this text.
fn expect_page(page: &str, expected: &str) {
    let path = workspace_file(page);
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(path, expected).unwrap();
    } else {
        let is_current = fs::read_to_string(path).unwrap() == expected;
        assert!(
            is_current,
            "{page} is out of date: UPDATE_DOCS=1 cargo test -p fleet-tests --test documents"
        );
    }
}

/// A page with another part between the markers of `name`.
fn with_part(page: &str, name: &str, part: &str) -> String {
    let (begin, end) = (format!("<!-- generated: {name} -->\n"), format!("<!-- end: {name} -->"));
    let (before, rest) = page.split_once(&begin).expect("the page has the marker");
    let (_, after) = rest.split_once(&end).expect("the page has the end marker");
    format!("{before}{begin}\n{part}\n{end}{after}")
}

/// Every Rust file below a directory.
fn rust_files(directory: &Path) -> Vec<PathBuf> {
    let paths = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path());
    paths
        .flat_map(|path| match path.extension() {
            _ if path.is_dir() => rust_files(&path),
            Some(extension) if extension == "rs" => vec![path],
            _ => Vec::new(),
        })
        .collect()
}

//! Documents and manifests agree with the sources, and with the output of the programs.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod logs;
mod pages;
mod programs;
mod targets;
mod tasks;
mod versions;
mod walks;

use std::{
    fs,
    path::{Path, PathBuf},
};

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

//! All files name the same version of Rust, with which CI compiles.

use std::{collections::BTreeMap, fs};

use harness::workspace_file;

/// The text between two texts in a file of the workspace, at the first occurrence.
fn between(path: &str, before: &str, after: &str) -> String {
    let text = fs::read_to_string(workspace_file(path)).unwrap();
    let rest = text.split_once(before).unwrap_or_else(|| panic!("{path}: no `{before}`")).1;
    let found = rest.split_once(after).unwrap_or_else(|| panic!("{path}: no `{after}`")).0;
    found.to_owned()
}

#[test]
fn every_file_that_names_a_version_of_rust_names_the_same() {
    let pinned = between("rust-toolchain.toml", "channel = \"", "\"");
    let minor = pinned.strip_suffix(".0").expect("the first release of a minor version");
    let image = format!("rust:{minor}-slim-bookworm");
    assert_eq!(between("Cargo.toml", "rust-version = \"", "\""), minor);
    for page in ["README.md", "CONTRIBUTING.md"] {
        let text = fs::read_to_string(workspace_file(page)).unwrap();
        assert!(text.contains(&format!("Rust {minor}")), "{page} does not name Rust {minor}");
    }
    assert_eq!(between("docker/Dockerfile", "BUILD_IMAGE=", "\n"), image);
    assert_eq!(between("docker/compose.yaml", "${BUILD_IMAGE:-", "}"), image);
    assert_eq!(between("docker/test.sh", "BUILD_IMAGE=", " "), image);
    assert_eq!(between("docs/deploy.md", "`BUILD_IMAGE`, `RUNTIME_IMAGE` | `", "`"), image);
}

#[test]
fn every_file_that_names_the_version_of_the_project_names_the_same() {
    let version = between("Cargo.toml", "\nversion = \"", "\"");
    for (path, before, after) in [
        ("python/Cargo.toml", "\nversion = \"", "\""),
        ("CITATION.cff", "\nversion: ", "\n"),
        ("docs/changelog.md", "\n## [", "]"),
        ("docs/deploy.md", "-t swarmevo/worker:", " "),
        ("docs/deploy/kubernetes/coordinator.yaml", "image: swarmevo/coordinator:", "\n"),
        ("docs/deploy/kubernetes/worker.yaml", "image: swarmevo/worker:", "\n"),
    ] {
        assert_eq!(between(path, before, after), version, "{path}");
    }
}

#[test]
fn images_are_built_from_every_crate_of_the_workspace() {
    let members = between("Cargo.toml", "members = [", "]");
    let context = fs::read_to_string(workspace_file(".dockerignore")).unwrap();
    let missing: Vec<&str> = members
        .split('"')
        .skip(1)
        .step_by(2)
        .map(|member| member.trim_end_matches("/*"))
        .filter(|member| !context.lines().any(|line| line.strip_prefix('!') == Some(*member)))
        .collect();
    assert!(missing.is_empty(), ".dockerignore leaves out {missing:?}");
}

/// One target directory then has them once for tests and for the Python package.
#[test]
fn other_people_s_crates_have_one_development_profile_in_both_workspaces() {
    let read = |path: &str| fs::read_to_string(workspace_file(path)).unwrap();
    let (manifest, lock) = (read("Cargo.toml"), read("python/Cargo.lock"));
    let is_shared = |name: &str| {
        let is_it = |package: &str| {
            package.contains(&format!("name = \"{name}\"\n")) && package.contains("\nsource = ")
        };
        name == "\"*\"" || lock.split("[[package]]").any(is_it)
    };
    let here: BTreeMap<String, String> = manifest
        .split("\n[profile.dev.package.")
        .skip(1)
        .map(|section| section.split_once("]\n").expect("a name"))
        .filter(|(name, _)| is_shared(name))
        .map(|(name, rest)| {
            let is_setting = |line: &&str| line.contains(" = ") && !line.starts_with('#');
            let settings: Vec<&str> = rest.lines().take_while(is_setting).collect();
            (name.to_owned(), settings.join(", "))
        })
        .collect();
    let there = between("python/Cargo.toml", "\n[profile.dev.package]\n", "\n[");
    let there: BTreeMap<String, String> = there
        .lines()
        .filter_map(|line| line.strip_suffix(" }")?.split_once(" = { "))
        .filter(|(name, _)| is_shared(name))
        .map(|(name, settings)| (name.to_owned(), settings.to_owned()))
        .collect();
    assert!(here.len() > 5, "{here:?}");
    assert_eq!(there, here);
}

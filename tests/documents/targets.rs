//! Cargo does not search some targets for tests, which saves compile time. Checks that these
//! targets have no tests.

use std::fs;

use harness::workspace_file;

#[test]
fn sources_that_cargo_does_not_test_contain_no_tests() {
    let sources = ["coordinator/src/main.rs", "worker/src/main.rs", "proto/src", "tests/harness"];
    let untested = sources
        .map(workspace_file)
        .into_iter()
        .flat_map(|source| if source.is_dir() { super::rust_files(&source) } else { vec![source] });
    for path in untested {
        let text = fs::read_to_string(&path).unwrap();
        assert!(!text.contains("#[cfg(test)]"), "{}", path.display());
        assert!(!text.contains("#[test]"), "{}", path.display());
    }
}

#[test]
fn crates_whose_documentation_is_not_tested_have_no_code_in_it() {
    let crates = fs::read_dir(workspace_file("crates")).unwrap();
    let crates = crates.map(|entry| entry.unwrap().path());
    let others = ["client", "coordinator", "proto", "sim-core", "worker"].map(workspace_file);
    let sources =
        crates.chain(others).map(|folder| (folder.join("Cargo.toml"), folder.join("src")));
    let harness = (workspace_file("tests/Cargo.toml"), workspace_file("tests/harness"));
    for (manifest, source) in sources.chain([harness]) {
        if !fs::read_to_string(&manifest).unwrap().contains("doctest = false") {
            continue;
        }
        for path in super::rust_files(&source) {
            let text = fs::read_to_string(&path).unwrap();
            let mut comments = text.lines().filter(|line| {
                let line = line.trim_start();
                line.starts_with("///") || line.starts_with("//!")
            });
            let fence = comments.find(|line| line.contains("```"));
            let (path, manifest) = (path.display(), manifest.display());
            assert_eq!(fence, None, "{path}: delete `doctest = false` in {manifest}");
        }
    }
}

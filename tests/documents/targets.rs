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
    let without = [
        "coordinator",
        "crates/bundle",
        "crates/telemetry",
        "crates/transport",
        "crates/web",
        "proto",
        "worker",
    ];
    let sources = without.map(|name| (format!("{name}/Cargo.toml"), format!("{name}/src")));
    let harness = ("tests/Cargo.toml".to_owned(), "tests/harness".to_owned());
    for (manifest, source) in sources.into_iter().chain([harness]) {
        let text = fs::read_to_string(workspace_file(&manifest)).unwrap();
        assert!(text.contains("doctest = false"), "{manifest}: take it off this list");
        for path in super::rust_files(&workspace_file(&source)) {
            let text = fs::read_to_string(&path).unwrap();
            let mut comments = text.lines().filter(|line| {
                let line = line.trim_start();
                line.starts_with("///") || line.starts_with("//!")
            });
            let fence = comments.find(|line| line.contains("```"));
            assert_eq!(fence, None, "{}: delete `doctest = false` in {manifest}", path.display());
        }
    }
}

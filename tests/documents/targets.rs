//! No test is where Cargo was told that there are none.

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

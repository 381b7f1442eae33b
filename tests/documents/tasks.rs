//! `docs/tasks.md` has every name that a script can use.

use std::fs;

use harness::workspace_file;

#[test]
fn every_name_that_scripts_see_is_in_the_reference() {
    let names = fs::read_to_string(workspace_file("sim-core/src/script/names.rs")).unwrap();
    let reference = fs::read_to_string(workspace_file("docs/tasks.md")).unwrap();
    let rows = names.lines().filter_map(|line| line.trim().strip_prefix('"'));
    let names: Vec<&str> =
        rows.filter_map(|row| row.split_once("\" = ")).map(|(name, _)| name).collect();
    assert!(names.len() > 30, "{names:?}");
    // The name is in code, alone or in an expression such as `robot.distance(other)`.
    let code: Vec<&str> = reference.split('`').skip(1).step_by(2).collect();
    let words = |text: &str| -> Vec<String> {
        let words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
        words.map(str::to_owned).collect()
    };
    let said: std::collections::BTreeSet<String> = code.into_iter().flat_map(words).collect();
    let missing: Vec<&&str> = names.iter().filter(|name| !said.contains(**name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

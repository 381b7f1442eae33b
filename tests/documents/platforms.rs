//! The table of platforms generates a table of the page on bodies.

use std::{fmt::Write as _, fs};

use experiment_file::{Fact, PLATFORMS};
use harness::workspace_file;

use super::{expect_page, with_part};

const PAGE: &str = "docs/bodies.md";

/// A row for each number of each platform.
fn table() -> String {
    let mut table = String::from("| platform | key | number | source |\n|---|---|---|---|\n");
    for platform in PLATFORMS {
        let name = platform.name;
        for Fact { key, value, source } in platform.facts {
            let value = value.value().expect("a number");
            let _ = writeln!(table, "| `{name}` | `{key}` | {value} | {source} |");
        }
        let unknown: Vec<String> = platform.unknown.iter().map(|key| format!("`{key}`")).collect();
        let _ = writeln!(
            table,
            "| `{name}` | {} | the usual defaults | none found |",
            unknown.join(", ")
        );
    }
    table
}

#[test]
fn the_page_on_bodies_has_the_numbers_of_all_platforms() {
    let page = fs::read_to_string(workspace_file(PAGE)).unwrap();
    expect_page(PAGE, &with_part(&page, "platforms", &table()));
}

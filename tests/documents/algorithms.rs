//! The registry of algorithms generates a table.

use std::{fmt::Write as _, fs};

use evolution::ALGORITHMS;
use experiment_file::{AlgorithmDescription, Domain};
use harness::workspace_file;

use super::{expect_page, with_part};

const PAGE: &str = "docs/algorithms.md";

fn algorithms() -> String {
    let mut table = String::from(
        "| name | | learns | state, numbers | individuals | genes |\n|---|---|---|---|---|---|\n",
    );
    for AlgorithmDescription {
        name,
        title,
        learns,
        state,
        individuals_min,
        genes_max,
        parameters,
        ..
    } in ALGORITHMS
    {
        let genes = genes_max.map_or("any".to_owned(), |max| format!("up to {max}"));
        let elite = parameters.iter().find(|p| matches!(p.domain, Domain::BelowPopulationSize));
        let individuals = elite.map_or(format!("{individuals_min} or more"), |parameter| {
            format!("more than `{}`", parameter.key)
        });
        let _ = writeln!(
            table,
            "| `{name}` | {title} | {learns} | {state} | {individuals} | {genes} |"
        );
    }
    table
}

#[test]
fn the_page_on_algorithms_has_the_table_of_the_registry() {
    let page = fs::read_to_string(workspace_file(PAGE)).unwrap();
    expect_page(PAGE, &with_part(&page, "algorithms", &algorithms()));
}

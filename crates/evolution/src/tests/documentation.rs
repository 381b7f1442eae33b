//! The registry generates the table in `docs/algorithms.md`. After a change, update it:
//! `UPDATE_DOCS=1 cargo test -p evolution documentation`.

use std::{env, fmt::Write as _, fs};

use experiment_file::{AlgorithmDescription, Domain};

use crate::ALGORITHMS;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/algorithms.md");

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

/// `page` with the part between the markers of `name` replaced.
fn with_part(page: &str, name: &str, part: &str) -> String {
    let (begin, end) = (format!("<!-- generated: {name} -->\n"), format!("<!-- end: {name} -->"));
    let (before, rest) = page.split_once(&begin).expect("the page has the marker");
    let (_, after) = rest.split_once(&end).expect("the page has the end marker");
    format!("{before}{begin}\n{part}\n{end}{after}")
}

#[test]
fn documentation_has_the_table_of_the_registry() {
    let page = fs::read_to_string(PAGE).unwrap();
    let expected = with_part(&page, "algorithms", &algorithms());
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(PAGE, &expected).unwrap();
    } else {
        assert!(page == expected, "docs/algorithms.md is out of date: UPDATE_DOCS=1");
    }
}

//! The registry generates the tables in `docs/algorithms.md`. After a change, update them:
//! `UPDATE_DOCS=1 cargo test -p evolution documentation`.

use std::{env, fmt::Write as _, fs};

use experiment_file::{AlgorithmDescription, DefaultValue, Domain, limits};

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

fn parameters() -> String {
    let mut table =
        String::from("| algorithm | key | values | default | |\n|---|---|---|---|---|\n");
    for algorithm in ALGORITHMS {
        for parameter in algorithm.parameters {
            let values = match parameter.domain {
                Domain::Positive => "above 0".to_owned(),
                Domain::Between(min, limits::MAGNITUDE) => format!("{min} or more"),
                Domain::Between(min, max) if min == 1.0 / limits::MAGNITUDE => {
                    format!("above 0, up to {max}")
                }
                Domain::Between(min, max) if max == 1.0 - f64::EPSILON => {
                    format!("{min} or more, below 1")
                }
                Domain::Between(min, max) => format!("{min} to {max}"),
                Domain::Whole(min, max) => format!("whole, {min} to {max}"),
                Domain::BelowPopulationSize => "whole, below `population_size`".to_owned(),
                Domain::OneOf { names, .. } => format!("`{}`", names.join("`, `")),
                other => other.to_string(),
            };
            let default = match parameter.default {
                DefaultValue::Number(number) => number.to_string(),
                DefaultValue::Whole(number) => number.to_string(),
                DefaultValue::Name(name) => format!("`{name}`"),
                DefaultValue::Formula(formula) => formula.to_owned(),
                other => panic!("no algorithm has {other:?}"),
            };
            let (name, key, meaning) = (algorithm.name, parameter.key, parameter.meaning);
            let _ = writeln!(table, "| `{name}` | `{key}` | {values} | {default} | {meaning} |");
        }
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
fn documentation_has_the_tables_of_the_registry() {
    let page = fs::read_to_string(PAGE).unwrap();
    let expected = with_part(&page, "algorithms", &algorithms());
    let expected = with_part(&expected, "parameters", &parameters());
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(PAGE, &expected).unwrap();
    } else {
        assert!(page == expected, "docs/algorithms.md is out of date: UPDATE_DOCS=1");
    }
}
